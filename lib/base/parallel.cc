#include "lib/base/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace vog {
namespace {

std::atomic<int> max_threads = 0;

std::size_t ThreadsFor(std::size_t count) {
  const int limit = max_threads;
  const auto available = static_cast<std::size_t>(limit > 0 ? limit : ProcessorCount());
  return std::clamp<std::size_t>(available, 1, std::max<std::size_t>(count, 1));
}

/// The failure with the smallest index, whichever thread met it first.
class FirstFailure {
 public:
  void Record(std::size_t index) {
    const std::lock_guard lock(mutex_);
    if (failure_ && index_ < index) return;
    failure_ = std::current_exception();
    index_ = index;
  }
  void Rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr failure_;
  std::size_t index_ = 0;
};

}  // namespace

int ProcessorCount() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

void SetParallelThreads(int threads) { max_threads = threads; }

void ParallelFor(std::size_t count, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next = 0;
  FirstFailure failure;
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        body(i);
      } catch (...) {
        failure.Record(i);
      }
    }
  };
  std::vector<std::jthread> helpers;
  for (std::size_t i = 1; i < ThreadsFor(count); ++i) helpers.emplace_back(work);
  work();
  helpers.clear();  // Joins.
  failure.Rethrow();
}

}  // namespace vog
