#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace vog {

/// Replaces `path` piece by piece so that a crash at any moment leaves the old file or the new one,
/// never a mixture: written beside it, flushed to the disk, renamed. All throw SystemError (a full
/// disk, a missing permission) naming the file; nothing is left behind then.
class AtomicFileWriter {
 public:
  explicit AtomicFileWriter(const std::filesystem::path& path);
  /// Leaves the old file unless all was committed.
  ~AtomicFileWriter();
  AtomicFileWriter(const AtomicFileWriter&) = delete;
  AtomicFileWriter& operator=(const AtomicFileWriter&) = delete;

  void Write(std::string_view bytes);
  /// Makes what was written the file. @pre called once, last.
  void Commit();

 private:
  std::filesystem::path path_, beside_;
  int fd_;
  bool committed_ = false;
};

/// The same at once. @throws SystemError as above.
void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes);

/// @throws SystemError naming the file when it cannot be read.
std::string ReadFile(const std::filesystem::path& path);

/// Whether the file is there and holds exactly `bytes`.
bool FileHolds(const std::filesystem::path& path, std::string_view bytes);

/// What a file looks like from outside.
struct FileState {
  std::uint64_t size = 0;
  std::int64_t modified_ns = 0;  ///< When its content was last written, as the file system says.
};
/// Nothing when there is no such file.
std::optional<FileState> StateOf(const std::filesystem::path& path);

/// A file's bytes in memory without reading them: the system reads a page when it is looked at. A
/// file that is replaced meanwhile stays as it was; one that is shortened in place does not.
class MappedFile {
 public:
  /// nullptr when it cannot be mapped.
  static std::shared_ptr<const MappedFile> Open(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::string_view bytes() const { return bytes_; }
  const FileState& state() const { return state_; }

 private:
  MappedFile(std::string_view bytes, const FileState& state) : bytes_(bytes), state_(state) {}

  std::string_view bytes_;
  FileState state_;
};

/// CRC-32 of zlib and PNG.
std::uint32_t Crc32(std::string_view bytes);

/// A check sum as fast as memory, for large files of this program alone. Damage within one word of
/// 8 bytes is always noticed, any other but once in 2^64 times.
std::uint64_t Checksum64(std::string_view bytes);

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
