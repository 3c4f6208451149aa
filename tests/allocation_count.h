// Allocations of this thread that fail on request, and how many there are. Linked by btfc_allocation_tests
// alone: it replaces malloc, or with AddressSanitizer operator new.
#pragma once
#include <cstdint>

namespace btfc::test {

struct AllocationPlan {
  std::uint64_t good = UINT64_MAX;  // so many succeed, then one fails
  bool all_that_follow = false;     // and all after it
};

struct AllocationCount {
  std::uint64_t asked = 0, failed = 0;
  std::int64_t blocks = 0;                 // held: 0 where everything was given back
  std::int64_t bytes = 0, most_bytes = 0;  // of those held
};

void arm_allocations(const AllocationPlan& plan = {});
// What was asked for since.
AllocationCount disarm_allocations();

}  // namespace btfc::test
