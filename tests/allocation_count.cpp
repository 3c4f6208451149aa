// The allocator of btfc_allocation_tests: it fails where a test asks for it, and counts what is held.
#include "tests/allocation_count.h"

#include <malloc.h>

#include <algorithm>
#include <cstdlib>
#include <new>

namespace btfc::test {
namespace {

// Plain data: the allocator must not allocate.
thread_local bool t_armed = false;
thread_local AllocationPlan t_plan;
thread_local AllocationCount t_count;

bool may_allocate() {
  if (!t_armed) return true;
  const bool fails = t_count.asked >= t_plan.good && (t_plan.all_that_follow || t_count.asked == t_plan.good);
  ++t_count.asked;
  if (fails) ++t_count.failed;
  return !fails;
}

void* held(void* p) {
  if (!t_armed || p == nullptr) return p;
  ++t_count.blocks;
  t_count.bytes += static_cast<std::int64_t>(malloc_usable_size(p));
  t_count.most_bytes = std::max(t_count.most_bytes, t_count.bytes);
  return p;
}

void given_back(void* p) {
  if (!t_armed || p == nullptr) return;
  --t_count.blocks;
  t_count.bytes -= static_cast<std::int64_t>(malloc_usable_size(p));
}

}  // namespace

void arm_allocations(const AllocationPlan& plan) {
  t_plan = plan;
  t_count = {};
  t_armed = true;
}

AllocationCount disarm_allocations() {
  t_armed = false;
  return t_count;
}

}  // namespace btfc::test

using btfc::test::given_back;
using btfc::test::held;
using btfc::test::may_allocate;

#if defined(__SANITIZE_ADDRESS__)
// The sanitizer has its own malloc: C++ allocations alone.
void* operator new(std::size_t size) {
  void* p = may_allocate() ? held(std::malloc(size)) : nullptr;
  if (p == nullptr) throw std::bad_alloc();
  return p;
}
void operator delete(void* p) noexcept {
  given_back(p);
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept { operator delete(p); }
#else
// malloc itself, which operator new and zstd call; glibc's own stands behind it.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* p, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* p);

void* malloc(std::size_t size) { return may_allocate() ? held(__libc_malloc(size)) : nullptr; }
void* calloc(std::size_t count, std::size_t size) {
  return may_allocate() ? held(__libc_calloc(count, size)) : nullptr;
}
void* realloc(void* p, std::size_t size) {
  if (!may_allocate()) return nullptr;
  given_back(p);
  return held(__libc_realloc(p, size));
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return may_allocate() ? held(__libc_memalign(alignment, size)) : nullptr;
}
void free(void* p) {
  given_back(p);
  __libc_free(p);
}
}
#endif
