#pragma once

#include <cstddef>
#include <functional>

namespace vog {

/// Calls `body(i)` once for each i in [0, count), on as many threads as the machine has. `body`
/// must write only to what belongs to i: then the result is the same for any number of threads.
/// Rethrows the exception of the smallest i that threw.
void ParallelFor(std::size_t count, const std::function<void(std::size_t)>& body);

/// The processors that this process may use, at least 1.
int ProcessorCount();

/// Limits the threads of ParallelFor; 0 means all that the machine has.
void SetParallelThreads(int threads);

}  // namespace vog
