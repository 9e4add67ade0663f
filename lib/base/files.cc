#include "lib/base/files.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <bit>
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

void FlushDirectory(const std::filesystem::path& directory) {
  const int fd = ::open(directory.empty() ? "." : directory.c_str(), O_RDONLY | O_DIRECTORY);
  if (fd < 0) return;  // The rename stands; only its durability is not known.
  ::fsync(fd);
  ::close(fd);
}

FileState ToFileState(const struct stat& state) {
  constexpr std::int64_t kNanoseconds = 1'000'000'000;
  return {static_cast<std::uint64_t>(state.st_size),
          state.st_mtim.tv_sec * kNanoseconds + state.st_mtim.tv_nsec};
}

}  // namespace

AtomicFileWriter::AtomicFileWriter(const std::filesystem::path& path)
    : path_(path),
      beside_(path.string() + ".tmp"),
      fd_(::open(beside_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644)) {
  if (fd_ < 0) Fail(beside_, "create");
}

AtomicFileWriter::~AtomicFileWriter() {
  if (fd_ >= 0) ::close(fd_);
  if (!committed_) ::unlink(beside_.c_str());
}

void AtomicFileWriter::Write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) Fail(beside_, "write");
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void AtomicFileWriter::Commit() {
  if (::fsync(fd_) != 0) Fail(beside_, "flush");
  if (::close(std::exchange(fd_, -1)) != 0) Fail(beside_, "close");
  if (::rename(beside_.c_str(), path_.c_str()) != 0) Fail(path_, "replace");
  committed_ = true;
  FlushDirectory(path_.parent_path());
}

void WriteFileAtomically(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFileWriter file(path);
  file.Write(bytes);
  file.Commit();
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

bool FileHolds(const std::filesystem::path& path, std::string_view bytes) {
  const auto state = StateOf(path);
  return state && state->size == bytes.size() && std::filesystem::is_regular_file(path) &&
         ReadFile(path) == bytes;
}

std::optional<FileState> StateOf(const std::filesystem::path& path) {
  struct stat state;
  if (::stat(path.c_str(), &state) != 0) return std::nullopt;
  return ToFileState(state);
}

std::shared_ptr<const MappedFile> MappedFile::Open(const std::filesystem::path& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return nullptr;
  struct stat state;
  void* memory = MAP_FAILED;
  if (::fstat(fd, &state) == 0 && S_ISREG(state.st_mode) && state.st_size > 0)
    memory = ::mmap(nullptr, static_cast<std::size_t>(state.st_size), PROT_READ, MAP_SHARED, fd, 0);
  ::close(fd);
  if (memory == MAP_FAILED) return nullptr;
  const std::string_view bytes(static_cast<const char*>(memory),
                               static_cast<std::size_t>(state.st_size));
  return std::shared_ptr<const MappedFile>(new MappedFile(bytes, ToFileState(state)));
}

MappedFile::~MappedFile() { ::munmap(const_cast<char*>(bytes_.data()), bytes_.size()); }

std::uint32_t Crc32(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::uint64_t Checksum64(std::string_view bytes) {
  // Several sums side by side, so that none waits for the multiplication before it. Each step can
  // be undone: sums that differ once stay different unless a later difference makes up for it.
  constexpr std::size_t kLanes = 8, kWord = sizeof(std::uint64_t), kBlock = kLanes * kWord;
  const auto mixed = [](std::uint64_t sum, std::uint64_t word) {
    return std::rotl((sum ^ word) * 0x9e3779b97f4a7c15u, 29);
  };
  std::array<std::uint64_t, kLanes> sums;
  for (std::size_t lane = 0; lane < kLanes; ++lane) sums[lane] = lane + 1;
  std::array<std::uint64_t, kLanes> words;
  const auto add = [&] {
    for (std::size_t lane = 0; lane < kLanes; ++lane) sums[lane] = mixed(sums[lane], words[lane]);
  };
  std::size_t at = 0;
  for (; bytes.size() - at >= kBlock; at += kBlock) {
    std::memcpy(words.data(), bytes.data() + at, kBlock);
    add();
  }
  words.fill(0);
  if (at < bytes.size()) std::memcpy(words.data(), bytes.data() + at, bytes.size() - at);
  add();
  std::uint64_t sum = bytes.size();
  for (const std::uint64_t lane : sums) sum = mixed(sum, lane);
  return sum;
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
