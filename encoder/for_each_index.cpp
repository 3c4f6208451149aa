// A parallel loop that keeps its lowest error.
#include "encoder/for_each_index.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <mutex>

namespace btfc {

Result<Done> for_each_index(std::size_t count, const std::function<Result<Done>(std::size_t)>& work,
                            const std::function<void(std::size_t, std::size_t)>& progress) {
  std::atomic<std::size_t> failed_at{count};
  std::mutex lock;
  Error failure;
  std::size_t ended = 0;
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
    if (i > failed_at.load(std::memory_order_relaxed)) return;
    const Result<Done> done = work(i);
    if (done && !progress) return;
    const std::lock_guard<std::mutex> hold(lock);
    if (!done && i < failed_at.load(std::memory_order_relaxed)) {
      failed_at.store(i, std::memory_order_relaxed);
      failure = done.error();
    }
    if (progress) progress(++ended, count);
  });
  if (failed_at.load() < count) return failure;
  return Done{};
}

}  // namespace btfc
