#include "tools/map/map_merge.h"

#include <optional>
#include <sstream>

#include "lib/base/errors.h"
#include "lib/base/log.h"

namespace vog {
namespace {

using Numbers = std::map<SubmapId, SubmapId>;

void RejectOther(const StoredMap& merged, const StoredMap& map,
                 const std::filesystem::path& folder) {
  if (map.voxel_size_m != merged.voxel_size_m)
    throw UsageError(folder.string() +
                     ": its voxels are of another size than those of the map before");
  if (map.sensor_model != merged.sensor_model)
    throw UsageError(folder.string() + ": its sensor model is another than that of the map before");
}

/// A line of a .g2o file with the new numbers of its vertices; nothing where one of them has none.
std::optional<std::string> Renumbered(const std::string& line, const Numbers& numbers) {
  std::istringstream words(line);
  std::string kind, rest;
  words >> kind;
  const int vertices = kind == "EDGE_SE3:QUAT" ? 2 : kind == "VERTEX_SE3:QUAT" || kind == "FIX";
  if (vertices == 0) return std::nullopt;
  std::string renumbered = kind;
  for (int i = 0; i < vertices; ++i) {
    SubmapId id = -1;
    words >> id;
    const auto found = numbers.find(id);
    if (!words || found == numbers.end()) return std::nullopt;
    renumbered += " " + std::to_string(found->second);
  }
  std::getline(words, rest);
  return renumbered + rest + "\n";
}

/// Vertices come first in a .g2o file, then what is fixed, then edges.
class GraphJoiner {
 public:
  void Add(const std::string& graph_g2o, const Numbers& numbers) {
    std::istringstream lines(graph_g2o);
    for (std::string line; std::getline(lines, line);) {
      const auto renumbered = Renumbered(line, numbers);
      if (renumbered)
        (line[0] == 'V' ? vertices_ : line[0] == 'F' ? fixed_ : edges_) += *renumbered;
    }
  }
  std::string Finish() const { return vertices_ + fixed_ + edges_; }

 private:
  std::string vertices_, fixed_, edges_;
};

}  // namespace

StoredMap MergeMaps(const std::vector<std::filesystem::path>& folders) {
  StoredMap merged;
  GraphJoiner graph;
  bool is_first = true;
  for (const auto& folder : folders) {
    const LoadedMap loaded = LoadMapFolder(folder);
    for (const std::string& fault : loaded.faults) LogLine(fault);
    const StoredMap& map = loaded.map;
    if (is_first) {
      merged = map;
      merged.submaps.clear();
      merged.X_WM.clear();
      merged.end.reset();  // Of a flight that the last submap may not be of.
      merged.put_in.reset();
      is_first = false;
    }
    RejectOther(merged, map, folder);
    merged.complete = merged.complete && map.complete;
    if (merged.run_id != map.run_id) merged.run_id = 0;
    Numbers numbers;
    for (const SubmapPtr& submap : map.submaps) {
      const auto id = static_cast<SubmapId>(merged.submaps.size());
      Submap renumbered = *submap;
      renumbered.base.id = numbers[submap->id()] = id;
      merged.submaps.push_back(std::make_shared<Submap>(std::move(renumbered)));
      merged.X_WM[id] = map.X_WM.at(submap->id());
    }
    graph.Add(map.graph_g2o, numbers);
  }
  merged.graph_g2o = graph.Finish();
  return merged;
}

}  // namespace vog
