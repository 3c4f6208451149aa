// How many threads work.
#pragma once
#include <functional>

namespace btfc {

// Runs work in a oneTBB arena of so many threads, 0: as many as the machine has.
void run_on_threads(unsigned threads, const std::function<void()>& work);

}  // namespace btfc
