#include "lib/posegraph/g2o.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>

#include "lib/base/files.h"

namespace vog {
namespace {

constexpr std::string_view kVertex3 = "VERTEX_SE3:QUAT", kEdge3 = "EDGE_SE3:QUAT";
constexpr std::string_view kVertex2 = "VERTEX_SE2", kEdge2 = "EDGE_SE2", kFix = "FIX";

/// Rows of a planar pose in one of three dimensions.
constexpr int kPlanarRows[3] = {0, 1, 5};

Pose3 PlanarPose(double x_m, double y_m, double yaw_rad) {
  return MakePose({x_m, y_m, 0}, {0, 0, yaw_rad});
}

// --- writing ---

void AppendNumber(double number, std::string& line) { line += " " + ToText(number); }

void AppendPose(const Pose3& X, bool is_planar, std::string& line) {
  const Vec3& p = X.translation();
  if (is_planar) {
    for (const double number : {p.x(), p.y(), YawOf(X)}) AppendNumber(number, line);
    return;
  }
  for (const double number : p) AppendNumber(number, line);
  const Eigen::Vector4d q = Eigen::Quaterniond(X.linear()).coeffs();
  for (const double number : q) AppendNumber(number, line);
}

void AppendInformation(const Mat6& information, bool is_planar, std::string& line) {
  const int size = is_planar ? 3 : 6;
  const auto row_of = [&](int i) { return is_planar ? kPlanarRows[i] : i; };
  for (int row = 0; row < size; ++row)
    for (int col = row; col < size; ++col)
      AppendNumber(information(row_of(row), row_of(col)), line);
}

// --- reading ---

/// The words of a line, one after another.
class Words {
 public:
  explicit Words(std::string_view line) : line_(line) {}

  /// Empty at the end.
  std::string_view Next() {
    constexpr std::string_view kSpace = " \t\r\v\f";
    const std::size_t begin = std::min(line_.find_first_not_of(kSpace), line_.size());
    const std::size_t end = std::min(line_.find_first_of(kSpace, begin), line_.size());
    const std::string_view word = line_.substr(begin, end - begin);
    line_.remove_prefix(end);
    return word;
  }

 private:
  std::string_view line_;
};

/// What is wrong with a line.
struct Fault {
  std::string text;
};

template <class Number>
Number ToNumber(std::string_view word, const char* wanted) {
  Number number{};
  const bool has_plus = word.size() > 1 && word[0] == '+' && word[1] != '-';
  const char *begin = word.data() + has_plus, *end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(begin, end, number);
  if (error != std::errc() || stop != end || word.empty())
    throw Fault{word.empty() ? std::string("ends before ") + wanted
                             : "'" + std::string(word) + "' is not " + wanted};
  return number;
}

NodeId ReadId(Words& words) {
  const auto id = ToNumber<NodeId>(words.Next(), "the number of a vertex (an integer from 0 on)");
  if (id < 0) throw Fault{"vertices have numbers from 0 on, not " + std::to_string(id)};
  return id;
}

double ReadNumber(Words& words) {
  const auto number = ToNumber<double>(words.Next(), "a number");
  if (!std::isfinite(number)) throw Fault{"numbers must be finite"};
  return number;
}

Pose3 ReadPose(Words& words, bool is_planar) {
  if (is_planar) {
    const double x_m = ReadNumber(words), y_m = ReadNumber(words);
    return PlanarPose(x_m, y_m, ReadNumber(words));
  }
  Vec3 p;
  Eigen::Quaterniond q;
  for (double& number : p) number = ReadNumber(words);
  for (double& number : q.coeffs()) number = ReadNumber(words);
  constexpr double kTolerance = 1e-3;
  if (!(std::abs(q.norm() - 1) < kTolerance))
    throw Fault{"the quaternion (qx qy qz qw) has norm " + ToText(q.norm()) + "; 1 is allowed"};
  return MakePose(p, q);
}

Mat6 ReadInformation(Words& words, bool is_planar) {
  const int size = is_planar ? 3 : 6;
  Mat6 information = Mat6::Identity();
  for (int i = 0; i < size; ++i) {
    for (int k = i; k < size; ++k) {
      const int row = is_planar ? kPlanarRows[i] : i, col = is_planar ? kPlanarRows[k] : k;
      information(row, col) = information(col, row) = ReadNumber(words);
    }
  }
  constexpr double kTolerance = 1e-9;  // Of the largest eigenvalue.
  const Vec6 eigenvalues =
      Eigen::SelfAdjointEigenSolver<Mat6>(information, Eigen::EigenvaluesOnly).eigenvalues();
  if (eigenvalues[0] < -kTolerance * std::abs(eigenvalues[5]))
    throw Fault{"the information matrix has the eigenvalue " + ToText(eigenvalues[0]) +
                "; none below 0 is allowed"};
  return information;
}

/// Reads a file line by line into a G2oFile.
class Reader {
 public:
  explicit Reader(const std::string& name) : name_(name) {}

  void ReadLine(std::string_view line) {
    ++line_;
    Words words(line);
    const std::string_view tag = words.Next();
    if (tag.empty()) return;
    try {
      if (tag[0] == '#') {
        ++file_.comments;
      } else if (tag == kVertex3 || tag == kVertex2) {
        ReadVertex(words, tag == kVertex2);
      } else if (tag == kEdge3 || tag == kEdge2) {
        ReadEdge(words, tag == kEdge2);
      } else if (tag == kFix) {
        ReadFix(words);
      } else {
        ++file_.unknown[std::string(tag)];
      }
    } catch (const Fault& fault) {
      Report(line_, std::string(tag) + ": " + fault.text);
    }
  }

  /// Edges may stand before their vertices, so that they are checked at the end.
  G2oFile Finish() {
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const auto missing = MissingOf({edges_[i].from, edges_[i].to});
      if (missing) {
        Report(edge_lines_[i], "edge to vertex " + std::to_string(*missing) + ", which is missing");
      } else {
        file_.graph.edges.push_back(edges_[i]);
      }
    }
    for (const auto& [id, line] : fixed_) {
      if (MissingOf({id})) {
        Report(line, "FIX of vertex " + std::to_string(id) + ", which is missing");
      } else {
        file_.graph.fixed.insert(id);
      }
    }
    return std::move(file_);
  }

 private:
  void Report(int line, const std::string& text) {
    file_.faults.push_back(name_ + ":" + std::to_string(line) + ": " + text);
  }

  void ReadVertex(Words& words, bool is_planar) {
    CheckDimensions(is_planar);
    const NodeId id = ReadId(words);
    const Pose3 X_W = ReadPose(words, is_planar);
    ExpectEnd(words);
    if (!file_.graph.vertices.emplace(id, X_W).second)
      throw Fault{"vertex " + std::to_string(id) + " is there already"};
  }

  void ReadEdge(Words& words, bool is_planar) {
    CheckDimensions(is_planar);
    G2oEdge edge;
    edge.from = ReadId(words);
    edge.to = ReadId(words);
    edge.X_ik = ReadPose(words, is_planar);
    edge.information = ReadInformation(words, is_planar);
    ExpectEnd(words);
    if (edge.from == edge.to)
      throw Fault{"an edge from vertex " + std::to_string(edge.from) + " to itself"};
    edges_.push_back(edge);
    edge_lines_.push_back(line_);
  }

  void ReadFix(Words& words) {
    fixed_.emplace_back(ReadId(words), line_);
    for (std::string_view word = words.Next(); !word.empty(); word = words.Next()) {
      Words one(word);
      fixed_.emplace_back(ReadId(one), line_);
    }
  }

  void CheckDimensions(bool is_planar) {
    const bool is_first = !has_dimensions_;
    has_dimensions_ = true;
    if (is_first) file_.graph.is_planar = is_planar;
    if (file_.graph.is_planar != is_planar)
      throw Fault{"a file is either of SE2 or of SE3, not of both"};
  }

  static void ExpectEnd(Words& words) {
    const std::string_view word = words.Next();
    if (!word.empty()) throw Fault{"'" + std::string(word) + "' is more than belongs here"};
  }

  std::optional<NodeId> MissingOf(std::initializer_list<NodeId> ids) const {
    for (const NodeId id : ids)
      if (!file_.graph.vertices.count(id)) return id;
    return std::nullopt;
  }

  std::string name_;
  int line_ = 0;
  bool has_dimensions_ = false;
  G2oFile file_;
  std::vector<G2oEdge> edges_;
  std::vector<int> edge_lines_;
  std::vector<std::pair<NodeId, int>> fixed_;  ///< With their lines.
};

// --- weights ---

/// The information about residuals in radians.
Mat6 InRadians(const Mat6& information, RotationInformation rotation) {
  if (rotation == RotationInformation::kRadians) return information;
  Vec6 scale;
  scale << 1, 1, 1, 0.5, 0.5, 0.5;
  return scale.asDiagonal() * information * scale.asDiagonal();
}

/// `count` over the trace of the inverse, the weight that SE-Sync takes; 0 where there is none.
template <class Matrix>
double MeanWeight(const Matrix& information, double count) {
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(information, Eigen::EigenvaluesOnly);
  const auto& values = eigen.eigenvalues();
  constexpr double kRankTolerance = 1e-13;  // Of the largest eigenvalue.
  if (values[0] <= kRankTolerance * values[values.size() - 1]) return 0;
  return count / values.cwiseInverse().sum();
}

/// The whitening with which a Constraint counts for what it does in Objective::kChordal, by
/// |R_k - R_i R_ik|_F^2 = 2 |2 vec(dq)|^2. The numbers are SE-Sync's: in two dimensions kappa is
/// the information of the angle itself.
Whitening ChordalWhiteningOf(const Mat6& information, bool is_planar) {
  double tau = 0, kappa = 0;
  if (is_planar) {
    tau = MeanWeight<Eigen::Matrix2d>(information.topLeftCorner<2, 2>(), 2);
    kappa = information(5, 5);
  } else {
    tau = MeanWeight<Mat3>(information.topLeftCorner<3, 3>(), 3);
    kappa = MeanWeight<Mat3>(information.bottomRightCorner<3, 3>(), 1.5);
  }
  Mat6 chordal = Mat6::Zero();
  chordal.diagonal() << Vec3::Constant(tau), Vec3::Constant(2 * kappa);
  return WhiteningOfInformation(chordal);
}

}  // namespace

G2oGraph ToG2oGraph(const std::map<NodeId, Pose3>& X_W,
                    const std::map<int, Constraint>& constraints) {
  G2oGraph g2o{X_W, {}, {}, false};
  if (!g2o.vertices.empty()) g2o.fixed.insert(g2o.vertices.begin()->first);
  for (const auto& [number, constraint] : constraints)
    g2o.edges.push_back(
        {constraint.from, constraint.to, constraint.X_ik, constraint.Information()});
  return g2o;
}

PoseGraph ToPoseGraph(const G2oGraph& g2o, const PoseGraphOptions& options,
                      RotationInformation rotation, Objective objective) {
  PoseGraph graph(options);
  for (const auto& [id, X_W] : g2o.vertices) graph.AddNode(id, X_W);
  for (const G2oEdge& edge : g2o.edges) {
    const Mat6 information =
        g2o.is_planar ? edge.information : InRadians(edge.information, rotation);
    const Whitening whitening = objective == Objective::kChordal
                                    ? ChordalWhiteningOf(information, g2o.is_planar)
                                    : WhiteningOfInformation(information);
    if (whitening.rows() == 0) continue;
    const bool is_odometry = std::abs(edge.to - edge.from) == 1;
    const ConstraintKind closure =
        whitening.rows() == 6 ? ConstraintKind::kFullClosure : ConstraintKind::kPartialClosure;
    graph.AddConstraint({edge.from, edge.to, is_odometry ? ConstraintKind::kOdometry : closure,
                         edge.X_ik, whitening});
  }
  for (const NodeId id : g2o.fixed) graph.Fix(id);
  for (const auto& part : ConnectedParts(g2o))
    if (std::none_of(part.begin(), part.end(), [&](NodeId id) { return g2o.fixed.count(id) > 0; }))
      graph.Fix(part.front());
  return graph;
}

std::vector<std::vector<NodeId>> ConnectedParts(const G2oGraph& graph) {
  std::map<NodeId, NodeId> leader;  // Towards the smallest number of a part.
  for (const auto& [id, X_W] : graph.vertices) leader[id] = id;
  const auto find = [&](NodeId id) {
    while (leader[id] != id) id = leader[id] = leader[leader[id]];
    return id;
  };
  for (const G2oEdge& edge : graph.edges) {
    const auto [low, high] = std::minmax({find(edge.from), find(edge.to)});
    leader[high] = low;
  }
  std::map<NodeId, std::vector<NodeId>> by_leader;
  for (const auto& [id, X_W] : graph.vertices) by_leader[find(id)].push_back(id);
  std::vector<std::vector<NodeId>> parts;
  for (auto& [id, part] : by_leader) parts.push_back(std::move(part));
  return parts;
}

std::string ToG2oText(const G2oGraph& graph) {
  std::string text;
  for (const auto& [id, X_W] : graph.vertices) {
    text += std::string(graph.is_planar ? kVertex2 : kVertex3) + " " + std::to_string(id);
    AppendPose(X_W, graph.is_planar, text);
    text += "\n";
  }
  for (const NodeId id : graph.fixed) text += "FIX " + std::to_string(id) + "\n";
  for (const G2oEdge& edge : graph.edges) {
    text += std::string(graph.is_planar ? kEdge2 : kEdge3) + " " + std::to_string(edge.from) + " " +
            std::to_string(edge.to);
    AppendPose(edge.X_ik, graph.is_planar, text);
    AppendInformation(edge.information, graph.is_planar, text);
    text += "\n";
  }
  return text;
}

G2oFile ParseG2o(std::string_view text, const std::string& name) {
  Reader reader(name);
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    reader.ReadLine(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return reader.Finish();
}

G2oFile ReadG2o(const std::filesystem::path& path) {
  G2oFile file = ParseG2o(ReadFile(path), path.string());
  if (!file.faults.empty()) throw UsageError(file.faults.front());
  return file;
}

}  // namespace vog
