#pragma once

#include <filesystem>
#include <string>

#include "lib/bus/lcm_bus.h"

namespace vog {

/// The Java archive of our message types: the installed one, or else one in the user's cache
/// folder, which is built when it is missing or the types have changed. @throws SystemError naming
/// the Debian package of what that needs.
std::filesystem::path TypesJar();

/// Becomes LCM's lcm-spy, which knows our types. @throws SystemError likewise.
[[noreturn]] void BecomeSpy(const std::string& url);

}  // namespace vog
