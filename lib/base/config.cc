#include "lib/base/config.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "lib/base/files.h"

namespace vog {
namespace {

constexpr int kMaxIncludeDepth = 8;

/// "config/a.toml:12: " or, for an override, "--set planner.x=1: ".
std::string Where(const toml::source_region& source) {
  const std::string path = source.path ? *source.path : "";
  if (path.starts_with("--set")) return path + ": ";
  return path + ":" + std::to_string(source.begin.line) + ": ";
}

std::string Format(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string Describe(Range range, bool integer) {
  const std::string kind = integer ? "an integer" : "a number";
  const bool lo = std::isfinite(range.lo), hi = std::isfinite(range.hi);
  if (lo && hi) return kind + " from " + Format(range.lo) + " to " + Format(range.hi);
  if (lo) return kind + " of at least " + Format(range.lo);
  if (hi) return kind + " of at most " + Format(range.hi);
  return kind;
}

std::string Describe(const std::vector<std::string>& allowed) {
  if (allowed.empty()) return "a string";
  std::string text = "one of";
  for (const std::string& name : allowed) text += " \"" + name + "\"";
  return text;
}

bool Contains(Range range, double value) { return value >= range.lo && value <= range.hi; }

/// Moves `from` into `into`; later values win, tables are merged. Moved, because toml++ forgets
/// where a node came from when it copies it.
void Merge(toml::table& into, toml::table&& from) {
  for (auto&& [key, node] : from) {
    toml::table* const theirs = node.as_table();
    toml::table* const ours = into[key].as_table();
    if (theirs != nullptr && ours != nullptr) {
      Merge(*ours, std::move(*theirs));
    } else {
      node.visit(
          [&into, &name = key](auto& value) { into.insert_or_assign(name, std::move(value)); });
    }
  }
}

toml::table ParseToml(std::string_view text, const std::string& name) {
  try {
    return toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    throw UsageError(Where(error.source()) + std::string(error.description()));
  }
}

toml::table ParseFile(const std::filesystem::path& path, int depth) {
  if (!std::filesystem::is_regular_file(path))
    throw UsageError(path.string() + ": no such configuration file");
  toml::table own;
  try {
    own = toml::parse_file(path.string());
  } catch (const toml::parse_error& error) {
    throw UsageError(Where(error.source()) + std::string(error.description()));
  }
  toml::table merged;
  if (const toml::node* include = own.get("include")) {
    const toml::array* files = include->as_array();
    if (files == nullptr || (!files->empty() && !files->is_homogeneous<std::string>()))
      throw UsageError(Where(include->source()) + "include must be an array of file names");
    if (depth == kMaxIncludeDepth)
      throw UsageError(Where(include->source()) + "includes are nested too deeply");
    for (const toml::node& file : *files)
      Merge(merged, ParseFile(path.parent_path() / **file.as_string(), depth + 1));
    own.erase("include");
  }
  Merge(merged, std::move(own));
  return merged;
}

class Filler final : public OptionsVisitor {
 public:
  Filler(const toml::table* table, std::string name) : table_(table), name_(std::move(name)) {}

  void RejectUnknownKeys() const {
    if (table_ == nullptr) return;
    for (const auto& [key, node] : *table_) {
      if (node.is_table() || known_.count(std::string(key.str()))) continue;
      std::string message = Where(node.source()) + "unknown key " + name_ + "." +
                            std::string(key.str()) + "; known keys:";
      for (const std::string& known : known_) message += " " + known;
      throw UsageError(message);
    }
  }

 protected:
  void Flag(const char* key, bool& field, const char*) override {
    if (const toml::node* node = Find(key)) {
      const auto value = node->value_exact<bool>();
      if (!value) Reject(*node, key, "true or false");
      field = *value;
    }
  }

  void Integer(const char* key, std::int64_t& field, Range range, const char*) override {
    if (const toml::node* node = Find(key)) {
      const auto value = node->value_exact<std::int64_t>();
      if (!value || !Contains(range, static_cast<double>(*value)))
        Reject(*node, key, Describe(range, true));
      field = *value;
    }
  }

  void Number(const char* key, double& field, Range range, const char*) override {
    if (const toml::node* node = Find(key)) field = NumberAt(*node, key, range);
  }

  void Numbers(const char* key, std::span<double> field, Range range, const char*) override {
    const toml::node* node = Find(key);
    if (node == nullptr) return;
    const toml::array* array = node->as_array();
    if (array == nullptr || array->size() != field.size())
      Reject(*node, key, "an array of " + std::to_string(field.size()) + " numbers");
    for (std::size_t i = 0; i < field.size(); ++i) field[i] = NumberAt(*array->get(i), key, range);
  }

  void Text(const char* key, std::string& field, const std::vector<std::string>& allowed,
            const char*) override {
    if (const toml::node* node = Find(key)) {
      const auto value = node->value_exact<std::string>();
      if (!value || !IsAllowed(*value, allowed)) Reject(*node, key, Describe(allowed));
      field = *value;
    }
  }

  void Texts(const char* key, std::vector<std::string>& field,
             const std::vector<std::string>& allowed, const char*) override {
    const toml::node* node = Find(key);
    if (node == nullptr) return;
    const std::string what =
        "a list of strings" + (allowed.empty() ? "" : ", each " + Describe(allowed));
    if (!node->is_array()) Reject(*node, key, what);
    field.clear();
    for (const toml::node& item : *node->as_array()) {
      const auto value = item.value_exact<std::string>();
      if (!value || !IsAllowed(*value, allowed)) Reject(item, key, what);
      field.push_back(*value);
    }
  }

 private:
  static bool IsAllowed(const std::string& value, const std::vector<std::string>& allowed) {
    return allowed.empty() || std::find(allowed.begin(), allowed.end(), value) != allowed.end();
  }

  const toml::node* Find(const char* key) {
    known_.insert(key);
    return table_ == nullptr ? nullptr : table_->get(key);
  }

  double NumberAt(const toml::node& node, const char* key, Range range) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !Contains(range, *value)) Reject(node, key, Describe(range, false));
    return *value;
  }

  [[noreturn]] void Reject(const toml::node& node, const char* key,
                           const std::string& allowed) const {
    std::ostringstream value;
    node.visit([&](const auto& exact) { value << exact; });
    throw UsageError(Where(node.source()) + name_ + "." + key + " must be " + allowed + ", not " +
                     value.str());
  }

  const toml::table* table_;
  std::string name_;
  std::set<std::string> known_;
};

class Describer final : public OptionsVisitor {
 public:
  std::vector<OptionDescription> descriptions;

 protected:
  void Flag(const char* key, bool& field, const char* help) override {
    descriptions.push_back({key, field ? "true" : "false", "true or false", help});
  }
  void Integer(const char* key, std::int64_t& field, Range range, const char* help) override {
    descriptions.push_back({key, std::to_string(field), Describe(range, true), help});
  }
  void Number(const char* key, double& field, Range range, const char* help) override {
    descriptions.push_back({key, ToText(field), Describe(range, false), help});
  }
  void Numbers(const char* key, std::span<double> field, Range range, const char* help) override {
    std::string value;
    for (const double number : field) value += (value.empty() ? "[" : ", ") + ToText(number);
    descriptions.push_back({key, value + "]", "each " + Describe(range, false), help});
  }
  void Text(const char* key, std::string& field, const std::vector<std::string>& allowed,
            const char* help) override {
    descriptions.push_back({key, "\"" + field + "\"", Describe(allowed), help});
  }
  void Texts(const char* key, std::vector<std::string>& field,
             const std::vector<std::string>& allowed, const char* help) override {
    std::string value;
    for (const std::string& text : field) value += (value.empty() ? "\"" : ", \"") + text + "\"";
    descriptions.push_back({key, "[" + value + "]", "each " + Describe(allowed), help});
  }
};

}  // namespace

void OptionsVisitor::operator()(const char* key, int& field, Range range, const char* help) {
  constexpr double kMax = std::numeric_limits<int>::max();
  std::int64_t wide = field;
  Integer(key, wide, Range{std::max(range.lo, -kMax), std::min(range.hi, kMax)}, help);
  field = static_cast<int>(wide);
}

void OptionsVisitor::operator()(const char* key, std::int64_t& field, Range range,
                                const char* help) {
  Integer(key, field, range, help);
}

void OptionsVisitor::operator()(const char* key, double& field, Range range, const char* help) {
  Number(key, field, range, help);
}

void OptionsVisitor::operator()(const char* key, std::string& field, const char* help) {
  Text(key, field, {}, help);
}

void OptionsVisitor::operator()(const char* key, Eigen::Vector3d& field, Range range,
                                const char* help) {
  Numbers(key, std::span<double>(field.data(), 3), range, help);
}

struct Config::Tables {
  toml::table root;
};

Config::Config() : tables_(std::make_unique<Tables>()) {}
Config::Config(Config&&) noexcept = default;
Config& Config::operator=(Config&&) noexcept = default;
Config::~Config() = default;

Config Config::Load(const std::string& path) {
  Config config;
  config.tables_->root = ParseFile(path, 0);
  config.directory_ = std::filesystem::path(path).parent_path().string();
  if (config.directory_.empty()) config.directory_ = ".";
  return config;
}

Config Config::Parse(std::string_view text, const std::string& name) {
  Config config;
  config.tables_->root = ParseToml(text, name);
  if (const toml::node* include = config.tables_->root.get("include"))
    throw UsageError(Where(include->source()) + "include is for files only");
  return config;
}

void Config::Set(std::string_view assignment) {
  const std::string name = "--set " + std::string(assignment);
  const std::size_t equals = assignment.find('=');
  const std::string path(assignment.substr(0, equals));
  if (equals == std::string_view::npos || path.find('.') == std::string::npos)
    throw UsageError(name + ": write --set table.key=value");
  const std::string value(assignment.substr(equals + 1));
  toml::table parsed;
  try {
    parsed = toml::parse(path + " = " + value, name);
  } catch (const toml::parse_error&) {
    parsed = ParseToml(path + " = '" + value + "'", name);
  }
  Merge(tables_->root, std::move(parsed));
}

Config::Reader Config::MakeReader(const std::string& name) const {
  const toml::node_view<const toml::node> node = std::as_const(tables_->root).at_path(name);
  if (node && !node.is_table())
    throw UsageError(Where(node.node()->source()) + name + " must be a table: write [" + name +
                     "]");
  return {std::make_unique<Filler>(node.as_table(), name)};
}

void Config::Reader::finish() const { static_cast<const Filler&>(*visitor).RejectUnknownKeys(); }

int Config::CountOf(const std::string& name) const {
  const toml::node* node = tables_->root.get(name);
  if (node == nullptr) return 0;
  if (!node->is_array_of_tables())
    throw UsageError(Where(node->source()) + name + " must be tables: write [[" + name + "]]");
  return static_cast<int>(node->as_array()->size());
}

std::string Config::WhereIs(const std::string& name) const {
  const auto node = std::as_const(tables_->root).at_path(name);
  return node ? Where(node.node()->source()) : "";
}

void Config::RejectUnknownTables(std::span<const std::string_view> known) const {
  const auto check = [&](const std::string& name, const toml::node& node) {
    if (std::find(known.begin(), known.end(), name) != known.end()) return;
    std::string message = Where(node.source()) + "unknown table [" + name + "]; known tables:";
    for (const std::string_view table : known) message += " " + std::string(table);
    throw UsageError(message);
  };
  for (const auto& [key, node] : tables_->root) {
    const std::string name(key.str());
    check(name, node);
    if (!node.is_table()) continue;
    for (const auto& [inner, value] : *node.as_table()) {
      if (value.is_table()) check(name + "." + std::string(inner.str()), value);
    }
  }
}

std::string Config::ToToml() const {
  std::ostringstream text;
  text << tables_->root << "\n";
  return text.str();
}

std::vector<OptionDescription> DescribeOptions(
    const std::function<void(OptionsVisitor&)>& visit_options) {
  Describer describer;
  visit_options(describer);
  return describer.descriptions;
}

std::string ToToml(const Eigen::Vector3d& v) {
  std::string text = "[";
  for (int i = 0; i < 3; ++i) {
    const std::string number = ToText(v[i]);
    const bool is_integer = number.find_first_of(".e") == std::string::npos;
    text += (i > 0 ? ", " : "") + number + (is_integer ? ".0" : "");
  }
  return text + "]";
}

}  // namespace vog
