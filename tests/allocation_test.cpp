// Memory that runs out at any allocation: files open, load and decode, or say so, lose nothing and work the
// next time. And files that claim more than they hold are refused before memory is asked for.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "btfc/btfc.h"
#include "tests/allocation_count.h"
#include "tests/damaged_file.h"

namespace btfc::test {
namespace {

// Of each model one small file.
Bytes smallest_vector(const char* model) {
  Bytes smallest;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(BTFC_VECTORS) / model)) {
    if (entry.path().extension() != ".btfc") continue;
    std::ifstream in(entry.path(), std::ios::binary);
    Bytes file{std::istreambuf_iterator<char>(in), {}};
    if (smallest.empty() || file.size() < smallest.size()) smallest = std::move(file);
  }
  return smallest;
}

// Everything that a user does with a file; calls that need what an earlier one did not give are left out.
// No memory of its own: allocations are counted.
struct Use {
  std::array<btfc_result, 12> results{};
  std::size_t calls = 0;
  std::array<std::uint8_t, 8 * 8 * 16> rect{};
  std::array<float, 4> value{};
  bool scratch = false;

  void note(btfc_result result) { results[calls++] = result; }
  bool done() const {
    return scratch && std::all_of(results.begin(), results.begin() + static_cast<std::ptrdiff_t>(calls),
                                  [](btfc_result r) { return r == BTFC_OK; });
  }
};

Use use(const Bytes& file) {
  Use run;
  btfc_error error{};
  btfc_reader* reader = nullptr;
  run.note(btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, &error));
  if (reader == nullptr) return run;
  btfc_texture* texture = nullptr;
  run.note(btfc_texture_load(reader, nullptr, &texture, &error));
  btfc_reader_free(reader);
  if (texture == nullptr) return run;
  btfc_query query{};
  query.view[2] = query.light[2] = 1;
  run.note(btfc_eval(texture, nullptr, &query, sizeof query, 1, run.value.data(), 4));
  const std::int32_t texel[2] = {3, 2};
  std::array<float, 4> sample{};
  run.note(
      btfc_decode_texels(texture, nullptr, 0, nullptr, texel, 1, BTFC_FLOAT32, sample.data(), sizeof sample));
  btfc_scratch* scratch = btfc_scratch_new(texture);
  run.scratch = scratch != nullptr;
  // Of an unbounded texture this makes tiles of 256 x 256 texels.
  run.note(btfc_decode_rect(texture, scratch, 0, nullptr, 0, 0, 8, 8, BTFC_FLOAT32, run.rect.data(), 8 * 16,
                            run.rect.size()));
  btfc_scratch_free(scratch);
  btfc_gpu_window window{0, 0, 16, 16};
  btfc_gpu_plan* plan = nullptr;
  run.note(btfc_gpu_plan_new(texture, &window, &plan, &error));
  btfc_gpu_plan_free(plan);
  btfc_texture_free(texture);
  return run;
}

btfc_result verify(const Bytes& file) {
  const btfc_source source = {[](void* user, std::uint64_t offset, void* to, std::size_t size) {
                                const Bytes& bytes = *static_cast<const Bytes*>(user);
                                if (offset > bytes.size() || size > bytes.size() - offset) return 1;
                                if (size != 0) std::memcpy(to, bytes.data() + offset, size);
                                return 0;
                              },
                              const_cast<Bytes*>(&file), file.size()};
  btfc_error error{};
  return btfc_verify(&source, nullptr, &error);
}

class Memory : public testing::TestWithParam<const char*> {};

TEST_P(Memory, RunsOutAtAnyAllocation) {
  const Bytes file = smallest_vector(GetParam());
  const Use sound = use(file);  // what is made once a program is made here
  ASSERT_TRUE(sound.done());
  ASSERT_EQ(verify(file), BTFC_OK);
  arm_allocations();
  (void)use(file);
  const AllocationCount all = disarm_allocations();
  ASSERT_EQ(all.blocks, 0);
  ASSERT_GT(all.asked, 10u);
  std::uint64_t refused = 0;
  // All of the first, which open and load; then some of the many of a tile.
  for (std::uint64_t n = 0; n < all.asked; n += n < 400 ? 1 : 1 + all.asked / 64) {
    for (const bool all_that_follow : {false, true}) {
      arm_allocations({n, all_that_follow});
      const Use run = use(file);
      const AllocationCount count = disarm_allocations();
      EXPECT_EQ(count.blocks, 0) << "allocation " << n << ": memory was lost";
      for (std::size_t i = 0; i < run.calls; ++i) {
        EXPECT_TRUE(run.results[i] == BTFC_OK || run.results[i] == BTFC_OUT_OF_MEMORY)
            << "allocation " << n << ", call " << i << ": " << btfc_result_name(run.results[i]);
      }
      if (run.done()) {
        EXPECT_EQ(run.rect, sound.rect);
      } else {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 0u);
  const Use again = use(file);
  EXPECT_TRUE(again.done());
  EXPECT_EQ(again.rect, sound.rect);
  EXPECT_EQ(again.value, sound.value);
  std::printf("%s: %llu allocations, %llu runs refused\n", GetParam(),
              static_cast<unsigned long long>(all.asked), static_cast<unsigned long long>(refused));
}

// A scratch keeps tiles from call to call: a call that found no memory leaves it fit for the next.
TEST_P(Memory, RunsOutBeforeAScratchIsUsedAgain) {
  const Bytes file = smallest_vector(GetParam());
  btfc_reader* reader = nullptr;
  btfc_texture* texture = nullptr;
  ASSERT_EQ(btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, nullptr), BTFC_OK);
  ASSERT_EQ(btfc_texture_load(reader, nullptr, &texture, nullptr), BTFC_OK);
  btfc_reader_free(reader);
  btfc_scratch* scratch = btfc_scratch_new(texture);
  const auto rect = [&](btfc_scratch* with, std::array<std::uint8_t, 8 * 8 * 16>& out) {
    return btfc_decode_rect(texture, with, 0, nullptr, 0, 0, 8, 8, BTFC_FLOAT32, out.data(), 8 * 16,
                            out.size());
  };
  std::array<std::uint8_t, 8 * 8 * 16> sound{}, out{};
  ASSERT_EQ(rect(nullptr, sound), BTFC_OK);
  btfc_result result = BTFC_OUT_OF_MEMORY;
  for (std::uint64_t n = 0; result != BTFC_OK && n < 200; ++n) {
    arm_allocations({n, false});
    result = rect(scratch, out);
    (void)disarm_allocations();
    ASSERT_TRUE(result == BTFC_OK || result == BTFC_OUT_OF_MEMORY) << btfc_result_name(result);
  }
  EXPECT_EQ(rect(scratch, out), BTFC_OK);
  EXPECT_EQ(out, sound);
  btfc_scratch_free(scratch);
  btfc_texture_free(texture);
}

TEST_P(Memory, RunsOutWhileVerifying) {
  const Bytes file = smallest_vector(GetParam());
  ASSERT_EQ(verify(file), BTFC_OK);
  arm_allocations();
  ASSERT_EQ(verify(file), BTFC_OK);
  const AllocationCount all = disarm_allocations();
  for (std::uint64_t n = 0; n < all.asked; ++n) {
    arm_allocations({n, false});
    const btfc_result result = verify(file);
    const AllocationCount count = disarm_allocations();
    EXPECT_EQ(count.blocks, 0) << "allocation " << n << ": memory was lost";
    EXPECT_TRUE(result == BTFC_OK || result == BTFC_OUT_OF_MEMORY) << btfc_result_name(result);
  }
  EXPECT_EQ(verify(file), BTFC_OK);
}

// What a refused file may take while it is looked at, beside three times its own size.
constexpr std::int64_t kRefusedBytes = 96 << 10;  // zstd's context takes 94.6 KiB

TEST_P(Memory, IsNotAskedForByClaims) {
  const Bytes file = smallest_vector(GetParam());
  const std::size_t index_end = kHeaderBytes + std::size_t{kIndexEntryBytes} * load_u32(&file[24]);
  const Parts parts = take_apart(file);
  std::vector<Bytes> claims;
  // Every number of the header and of the index.
  for (std::size_t at = 16; at + 8 <= index_end; at += 4) {
    for (const std::uint64_t value : {std::uint64_t{1} << 20, std::uint64_t{1} << 27, std::uint64_t{1} << 32,
                                      std::uint64_t{1} << 62, ~std::uint64_t{0}}) {
      Bytes claim = file;
      if (at % 8 == 0) store_u64(&claim[at], value);
      if (at % 8 == 4) store_u32(&claim[at], static_cast<std::uint32_t>(value));
      repair_hashes(claim);
      claims.push_back(std::move(claim));
    }
  }
  // Every number of HEAD and PARM.
  for (std::size_t i = 0; i < parts.entries.size(); ++i) {
    if (parts.entries[i].key.type != kHead && parts.entries[i].key.type != kParm) continue;
    if (parts.entries[i].codec != Codec::raw) continue;
    for (std::size_t at = 0; at + 4 <= parts.stored[i].size(); at += 4) {
      for (const std::uint32_t value : {255u, 256u, 1024u, 65535u, 65536u, 1u << 20, 1u << 30, 0xffffffffu}) {
        Parts claim = parts;
        store_u32(&claim.stored[i][at], value);
        claims.push_back(put_together(claim));
      }
    }
  }
  std::int64_t most = 0;
  std::size_t refused = 0;
  for (const Bytes& claim : claims) {
    btfc_reader* reader = nullptr;
    btfc_error error{};
    arm_allocations();
    const btfc_result result = btfc_reader_open_memory(claim.data(), claim.size(), nullptr, &reader, &error);
    btfc_reader_free(reader);
    const AllocationCount count = disarm_allocations();
    EXPECT_EQ(count.blocks, 0);
    if (result == BTFC_OK) continue;  // the number was no size
    ++refused;
    most = std::max(most, count.most_bytes);
    EXPECT_LE(count.most_bytes, kRefusedBytes + 3 * static_cast<std::int64_t>(claim.size())) << error.message;
  }
  EXPECT_GT(refused, claims.size() / 2);
  std::printf("%s: %zu files that claim more refused with %lld bytes at most\n", GetParam(), refused,
              static_cast<long long>(most));
}

INSTANTIATE_TEST_SUITE_P(Models, Memory, testing::ValuesIn([] {
                           std::vector<const char*> names;
                           for (const ModelFormat& model : models()) names.push_back(model.name);
                           return names;
                         }()),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace btfc::test
