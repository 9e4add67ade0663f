#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace vog {

/// What a child says: a terminal to talk to, so that it is told line by line, and a file that keeps
/// it. A file above the limit becomes FILE.1, and the one that was FILE.1 goes: a talkative program
/// cannot fill the disk.
class ChildOutput {
 public:
  /// @throws SystemError.
  explicit ChildOutput(std::filesystem::path file, std::uintmax_t max_bytes = 10'000'000);
  ~ChildOutput();
  ChildOutput(const ChildOutput&) = delete;
  ChildOutput& operator=(const ChildOutput&) = delete;

  /// The child's side of the terminal.
  int child_fd() const { return child_fd_; }
  /// What has been said since; at most 64 KB at a time. Written to the file, too: a disk that is
  /// full is counted and harmless.
  std::string Read();
  const std::filesystem::path& file() const { return file_; }
  std::int64_t lost_bytes() const { return lost_bytes_; }

 private:
  void Keep(const std::string& text);

  std::filesystem::path file_;
  std::uintmax_t max_bytes_;
  int fd_ = -1, child_fd_ = -1;
  std::int64_t lost_bytes_ = 0;
};

}  // namespace vog
