#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "lib/base/errors.h"

namespace vog {

/// The closed interval that an option's value must lie in.
struct Range {
  double lo = -std::numeric_limits<double>::infinity();
  double hi = std::numeric_limits<double>::infinity();
};
constexpr Range Any() { return {}; }
constexpr Range AtLeast(double lo) { return {lo, std::numeric_limits<double>::infinity()}; }
constexpr Range Between(double lo, double hi) { return {lo, hi}; }

/// The names of an enumeration's values in configuration files.
template <class Enum>
using Names = std::vector<std::pair<Enum, std::string>>;

/// The name of `value`; empty if it has none.
template <class Enum>
std::string NameOf(const Names<Enum>& names, Enum value) {
  for (const auto& [named, name] : names) {
    if (named == value) return name;
  }
  return {};
}

/// Visits each field of an options struct once; that one visit reads, checks and documents it. A
/// struct lists its fields in `void Visit(OptionsVisitor& v)`, one call a field:
///
///   v("max_range_m", max_range_m, Between(0.1, 100), "end of the sonar's window");
class OptionsVisitor {
 public:
  virtual ~OptionsVisitor() = default;

  void operator()(const char* key, bool& field, const char* help) { Flag(key, field, help); }
  void operator()(const char* key, int& field, Range range, const char* help);
  void operator()(const char* key, std::int64_t& field, Range range, const char* help);
  void operator()(const char* key, double& field, Range range, const char* help);
  void operator()(const char* key, std::string& field, const char* help);
  void operator()(const char* key, Eigen::Vector3d& field, Range range, const char* help);
  /// A list; `allowed` is empty where any text will do.
  void operator()(const char* key, std::vector<std::string>& field,
                  const std::vector<std::string>& allowed, const char* help) {
    Texts(key, field, allowed, help);
  }
  template <class Enum>
  requires std::is_enum_v<Enum>
  void operator()(const char* key, Enum& field, const Names<Enum>& names, const char* help);

 protected:
  virtual void Flag(const char* key, bool& field, const char* help) = 0;
  virtual void Integer(const char* key, std::int64_t& field, Range range, const char* help) = 0;
  virtual void Number(const char* key, double& field, Range range, const char* help) = 0;
  virtual void Numbers(const char* key, std::span<double> field, Range range, const char* help) = 0;
  /// `allowed` is empty where any text will do.
  virtual void Text(const char* key, std::string& field, const std::vector<std::string>& allowed,
                    const char* help) = 0;
  virtual void Texts(const char* key, std::vector<std::string>& field,
                     const std::vector<std::string>& allowed, const char* help) = 0;
};

/// The settings of a mission: TOML tables from files and overrides. Each value remembers the file
/// and line it came from, for the error message.
class Config {
 public:
  Config();
  Config(Config&&) noexcept;
  Config& operator=(Config&&) noexcept;
  ~Config();

  /// Reads `path`. A top-level `include = ["other.toml"]` (relative to the file) is read first;
  /// later values win. @throws UsageError naming file and line.
  static Config Load(const std::string& path);
  /// The same from memory; `name` stands for the file in messages, and includes are refused.
  static Config Parse(std::string_view text, const std::string& name);

  /// Sets one value: "table.key=value". The value is TOML; a bare word is taken as a string.
  /// @throws UsageError.
  void Set(std::string_view assignment);

  /// Fills `Options` from the table `name` ("planner", "scene.propeller", or "case[0]" for the
  /// first of the tables [[case]]); absent keys keep what `options` has, by itself the defaults.
  /// @throws UsageError on an unknown key, a wrong type or a value out of range.
  template <class Options>
  Options Read(const std::string& name, Options options = {}) const {
    ReadInto(name, [&](OptionsVisitor& visitor) { options.Visit(visitor); });
    return options;
  }

  /// How many tables [[name]] there are. @throws UsageError when `name` is something else.
  int CountOf(const std::string& name) const;

  /// Where `name` ("planner.range_m" or "case[0]") was set, for messages: "config/a.toml:12: " or
  /// "--set planner.range_m=1: "; empty where it is a default.
  std::string WhereIs(const std::string& name) const;

  /// @throws UsageError on a table that is not in `known`: most often a misspelt one.
  void RejectUnknownTables(std::span<const std::string_view> known) const;

  /// All tables after includes and overrides, as TOML that Parse() reads back.
  std::string ToToml() const;

  /// The folder of the file that was loaded; relative paths inside it start here.
  const std::string& directory() const { return directory_; }

 private:
  struct Tables;
  template <class Visit>
  void ReadInto(const std::string& name, Visit visit) const {
    const auto reader = MakeReader(name);
    visit(*reader.visitor);
    reader.finish();
  }
  struct Reader {
    std::unique_ptr<OptionsVisitor> visitor;
    void finish() const;
  };
  Reader MakeReader(const std::string& name) const;

  std::unique_ptr<Tables> tables_;
  std::string directory_ = ".";
};

/// A vector as a value of Config::Set(): reads back exactly.
std::string ToToml(const Eigen::Vector3d& v);

/// One line per option of an options struct: key, default, what is allowed, help.
struct OptionDescription {
  std::string key, value, allowed, help;
};

/// Collects the descriptions of `options`' fields with their present values.
std::vector<OptionDescription> DescribeOptions(
    const std::function<void(OptionsVisitor&)>& visit_options);

template <class Enum>
requires std::is_enum_v<Enum>
void OptionsVisitor::operator()(const char* key, Enum& field, const Names<Enum>& names,
                                const char* help) {
  std::vector<std::string> allowed;
  std::string text;
  for (const auto& [value, name] : names) {
    allowed.push_back(name);
    if (value == field) text = name;
  }
  Text(key, text, allowed, help);
  for (const auto& [value, name] : names) {
    if (name == text) field = value;
  }
}

}  // namespace vog
