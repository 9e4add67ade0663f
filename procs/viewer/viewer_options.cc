#include "procs/viewer/viewer_options.h"

#include <arpa/inet.h>

#include <algorithm>

namespace vog {
namespace {

constexpr std::size_t kMinToken = 12;

/// Takes as long whatever the first difference is.
bool AreEqual(const std::string& a, const std::string& b) {
  unsigned difference = a.size() != b.size();
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    difference |= static_cast<unsigned>(a[i] ^ b[i]);
  return difference == 0;
}

}  // namespace

bool ViewerOptions::IsLoopback() const { return bind.starts_with("127.") || bind == "::1"; }

bool ViewerOptions::IsToken(const std::string& shown) const {
  return token.empty() || AreEqual(shown, token);
}

void ViewerOptions::Validate() const {
  in_addr v4{};
  in6_addr v6{};
  if (::inet_pton(AF_INET, bind.c_str(), &v4) != 1 && ::inet_pton(AF_INET6, bind.c_str(), &v6) != 1)
    throw UsageError("viewer.bind: " + bind + " is no IP address");
  if (!token.empty() && token.size() < kMinToken)
    throw UsageError("viewer.token must have " + std::to_string(kMinToken) +
                     " characters at least");
  if (token.empty() && !IsLoopback())
    throw UsageError("viewer.bind = " + bind +
                     " is open to the network: set viewer.token, or bind to 127.0.0.1");
  if (token.empty() && operators)
    throw UsageError("viewer.operators: commands need a token; set viewer.token");
}

}  // namespace vog
