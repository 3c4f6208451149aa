// Parallel loops whose calls may fail.
#pragma once
#include <cstddef>
#include <functional>

#include "format/result.h"

namespace btfc {

// Calls work(i) for i = 0 … count-1 on the threads of the calling oneTBB arena. Of several errors the one of
// the lowest i is returned, whatever thread meets one first; indices above a failed one may be left out.
// progress, where given, hears of each call that ended, from one thread at a time.
Result<Done> for_each_index(std::size_t count, const std::function<Result<Done>(std::size_t)>& work,
                            const std::function<void(std::size_t done, std::size_t total)>& progress = {});

}  // namespace btfc
