#include "lib/base/files.h"

#include <fcntl.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <utility>

#include "lib/base/errors.h"

namespace vog {
namespace {

[[noreturn]] void Fail(const std::filesystem::path& path, const char* doing) {
  throw SystemError(path.string() + ": cannot " + doing + ": " + std::strerror(errno));
}

/// A file being written; removed again unless it is committed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& path)
      : path_(path), fd_(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
    if (fd_ < 0) Fail(path_, "create");
  }
  ~TemporaryFile() {
    if (fd_ >= 0) ::close(fd_);
    if (!committed_) ::unlink(path_.c_str());
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void Write(std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) Fail(path_, "write");
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
  }

  void CommitAs(const std::filesystem::path& target) {
    if (::fsync(fd_) != 0) Fail(path_, "flush");
    if (::close(std::exchange(fd_, -1)) != 0) Fail(path_, "close");
    if (::rename(path_.c_str(), target.c_str()) != 0) Fail(target, "replace");
    committed_ = true;
  }

 private:
  std::filesystem::path path_;
  int fd_;
  bool committed_ = false;
};

void FlushDirectory(const std::filesystem::path& directory) {
  const int fd = ::open(directory.empty() ? "." : directory.c_str(), O_RDONLY | O_DIRECTORY);
  if (fd < 0) return;  // The rename stands; only its durability is not known.
  ::fsync(fd);
  ::close(fd);
}

}  // namespace

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes) {
  TemporaryFile file(path.string() + ".tmp");
  file.Write(bytes);
  file.CommitAs(path);
  FlushDirectory(path.parent_path());
}

std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) Fail(path, "read");
  std::string bytes;
  std::array<char, 1 << 16> block;
  while (file.read(block.data(), block.size()) || file.gcount() > 0)
    bytes.append(block.data(), static_cast<std::size_t>(file.gcount()));
  if (file.bad()) Fail(path, "read");  // A folder, or a bad disk.
  return bytes;
}

std::uint32_t Crc32(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string Compress(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string compressed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(compressed.data()), &size,
            reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_BEST_SPEED);
  compressed.resize(size);
  return compressed;
}

std::optional<std::string> Decompress(std::string_view compressed, std::size_t size) {
  std::string bytes(size, '\0');
  uLongf written = size;
  const int status =
      uncompress(reinterpret_cast<Bytef*>(bytes.data()), &written,
                 reinterpret_cast<const Bytef*>(compressed.data()), compressed.size());
  if (status != Z_OK || written != size) return std::nullopt;
  return bytes;
}

std::string ToHex(std::uint32_t value) {
  std::array<char, 9> text;
  std::snprintf(text.data(), text.size(), "%08x", value);
  return text.data();
}

std::string ToText(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return std::string(text.data(), end);
}

}  // namespace vog
