#include "tools/report/settings.h"

#include <toml++/toml.h>

#include <sstream>

namespace vog {
namespace {

using Settings = std::map<std::string, std::string>;

void AddTable(const std::string& prefix, const toml::table& table, Settings& settings);

void AddNode(const std::string& name, const toml::node& node, Settings& settings) {
  if (const toml::table* table = node.as_table()) {
    AddTable(name + ".", *table, settings);
  } else if (const toml::array* array = node.as_array();
             array != nullptr && !array->empty() && array->is_array_of_tables()) {
    for (std::size_t i = 0; i < array->size(); ++i)
      AddNode(name + "[" + std::to_string(i) + "]", *array->get(i), settings);
  } else {
    std::ostringstream text;
    node.visit([&](const auto& value) { text << value; });
    settings[name] = text.str();
  }
}

void AddTable(const std::string& prefix, const toml::table& table, Settings& settings) {
  for (const auto& [key, node] : table) AddNode(prefix + std::string(key.str()), node, settings);
}

}  // namespace

std::map<std::string, std::string> SettingsOf(const std::string& toml) try {
  Settings settings;
  AddTable("", toml::parse(toml), settings);
  return settings;
} catch (const toml::parse_error&) {
  return {};
}

}  // namespace vog
