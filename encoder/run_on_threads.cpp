// A oneTBB arena with a limit.
#include "encoder/run_on_threads.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include <cstddef>

namespace btfc {

void run_on_threads(unsigned threads, const std::function<void()>& work) {
  const int count = threads == 0 ? tbb::info::default_concurrency() : static_cast<int>(threads);
  // The arena alone would not make threads beyond those of the machine.
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(count));
  tbb::task_arena arena(count);
  arena.execute(work);
}

}  // namespace btfc
