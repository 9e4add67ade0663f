#pragma once

#include <stdexcept>

namespace vog {

/// The user asked for something that cannot be: a bad option, file or argument. Programs print its
/// one line and exit with status 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The machine failed us: a full disk, a missing permission, a dead process. Programs print its one
/// line and exit with status 1.
struct SystemError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace vog
