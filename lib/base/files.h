#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace vog {

/// Replaces `path` with `bytes` so that a crash at any moment leaves the old file or the new one,
/// never a mixture: written beside it, flushed to the disk, renamed. @throws SystemError (a full
/// disk, a missing permission) naming the file; nothing is left behind then.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

/// @throws SystemError naming the file when it cannot be read.
std::string ReadFile(const std::filesystem::path& path);

/// CRC-32 of zlib and PNG.
std::uint32_t Crc32(std::string_view bytes);

/// Eight hexadecimal digits, as map.toml holds them.
std::string ToHex(std::uint32_t value);

/// The shortest decimal text that reads back as exactly `value`.
std::string ToText(double value);

/// zlib's compression (RFC 1950), fast rather than small.
std::string Compress(std::string_view bytes);
/// Nothing when `compressed` is damaged or does not give exactly `size` bytes.
std::optional<std::string> Decompress(std::string_view compressed, std::size_t size);

inline std::string_view AsText(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace vog
