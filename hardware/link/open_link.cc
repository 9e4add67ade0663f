#include "hardware/link/open_link.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "hardware/link/pty_link.h"
#include "hardware/link/recorded_links.h"
#include "hardware/link/serial_link.h"
#include "hardware/link/socket_can_link.h"
#include "hardware/link/sockets.h"
#include "hardware/link/tcp_client_link.h"
#include "hardware/link/udp_link.h"
#include "lib/base/errors.h"

namespace vog {
namespace {

constexpr std::size_t kExtendedDigits = 8;

/// KIND:ADDRESS?KEY=VALUE&...
struct LinkUrl {
  std::string whole, kind, address;
  std::map<std::string, std::string> settings;
};

[[noreturn]] void Refuse(const LinkUrl& url, const std::string& why) {
  throw UsageError("link \"" + url.whole + "\": " + why);
}

std::vector<std::string> Split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// "KEY=VALUE" in two; an empty value where there is no separator.
std::pair<std::string, std::string> Halves(const std::string& text, char separator) {
  const std::size_t at = text.find(separator);
  if (at == std::string::npos) return {text, ""};
  return {text.substr(0, at), text.substr(at + 1)};
}

LinkUrl ParseUrl(const std::string& text) {
  LinkUrl url;
  url.whole = text;
  const auto [place, settings] = Halves(text, '?');
  std::tie(url.kind, url.address) = Halves(place, ':');
  if (url.address.empty()) Refuse(url, "is not KIND:ADDRESS");
  if (settings.empty()) return url;
  for (const std::string& setting : Split(settings, '&')) {
    const auto [key, value] = Halves(setting, '=');
    if (value.empty()) Refuse(url, "\"" + setting + "\" is not KEY=VALUE");
    url.settings[key] = value;
  }
  return url;
}

/// The value of the only setting that this kind has.
std::optional<std::string> OnlySetting(const LinkUrl& url, const std::string& known) {
  std::optional<std::string> result;
  for (const auto& [key, value] : url.settings) {
    if (key != known) Refuse(url, "has no setting \"" + key + "\"");
    result = value;
  }
  return result;
}

template <class Number>
Number ParseSetting(const LinkUrl& url, const std::string& text, int base) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (error != std::errc() || end != text.data() + text.size())
    Refuse(url, "\"" + text + "\" is no number");
  return number;
}

int BaudOf(const LinkUrl& url) {
  const int baud = ParseSetting<int>(url, OnlySetting(url, "baud").value_or("9600"), 10);
  if (baud < 50 || baud > 4'000'000) Refuse(url, "baud is not within 50..4000000");
  return baud;
}

std::vector<CanFilter> FiltersOf(const LinkUrl& url) {
  std::vector<CanFilter> filters;
  const auto setting = OnlySetting(url, "filter");
  if (!setting) return filters;
  for (const std::string& text : Split(*setting, ',')) {
    const auto [id, mask] = Halves(text, ':');
    if (mask.empty()) Refuse(url, "\"" + text + "\" is not ID:MASK");
    filters.push_back({ParseSetting<std::uint32_t>(url, id, 16),
                       ParseSetting<std::uint32_t>(url, mask, 16), id.size() == kExtendedDigits});
  }
  return filters;
}

}  // namespace

std::unique_ptr<ByteLink> OpenByteLink(const LinkOptions& options) {
  const LinkUrl url = ParseUrl(options.url);
  if (url.kind == "serial") return std::make_unique<SerialLink>(url.address, BaudOf(url));
  if (url.kind == "udp")
    return std::make_unique<UdpLink>(ParsePort(url.address), OnlySetting(url, "peer"));
  OnlySetting(url, "");
  if (url.kind == "tcp") return std::make_unique<TcpClientLink>(url.address);
  if (url.kind == "pty") return std::make_unique<PtyLink>(url.address);
  if (url.kind == "file") return std::make_unique<FileLink>(url.address);
  Refuse(url, "is none of serial, tcp, udp, pty, file");
}

std::unique_ptr<CanLink> OpenCanLink(const LinkOptions& options) {
  const LinkUrl url = ParseUrl(options.url);
  if (url.kind == "can") return std::make_unique<SocketCanLink>(url.address, FiltersOf(url));
  OnlySetting(url, "");
  if (url.kind == "candump") return std::make_unique<CandumpLink>(url.address);
  Refuse(url, "is none of can, candump");
}

}  // namespace vog
