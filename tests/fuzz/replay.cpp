// btfc_fuzz_replay [--mutations N] [--only TARGET] FOLDER...: every fuzz target over the inputs in
// FOLDER/<target>, without libFuzzer, and over N mutations of them at random, which follow from their number.
// What does not hold ends the program, and leaves the input in replay-last. A folder may have inputs of some
// targets only.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/mutation.h"

// Each target's file is compiled with LLVMFuzzerTestOneInput renamed to one of these.
extern "C" {
int btfc_fuzz_open(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_chunk(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_params(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_decode(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_api(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_differential(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_round_trip(const std::uint8_t* data, std::size_t size);
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);
std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                    unsigned seed);
}

namespace {

using btfc::Bytes;
using btfc::test::Random;

struct Target {
  const char* name;
  int (*run)(const std::uint8_t*, std::size_t);
  bool of_files;  // inputs that file_mutator.cpp knows
};

constexpr Target kTargets[] = {{"open", btfc_fuzz_open, true},
                               {"chunk", btfc_fuzz_chunk, false},
                               {"params", btfc_fuzz_params, false},
                               {"decode", btfc_fuzz_decode, true},
                               {"api", btfc_fuzz_api, true},
                               {"differential", btfc_fuzz_differential, true},
                               {"round_trip", btfc_fuzz_round_trip, false}};
constexpr std::size_t kMostBytes = 16384;

Random g_random(1);

std::vector<Bytes> inputs_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  std::vector<Bytes> inputs;
  if (!std::filesystem::is_directory(folder)) return inputs;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  for (const auto& path : paths) {
    std::ifstream in(path, std::ios::binary);
    inputs.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return inputs;
}

// The input where the program ends: written before it runs.
void keep(const Bytes& input) {
  std::ofstream("replay-last", std::ios::binary)
      .write(reinterpret_cast<const char*>(input.data()), static_cast<std::streamsize>(input.size()));
}

Bytes mutated(const Target& target, Bytes input) {
  const std::size_t size = input.size();
  input.resize(kMostBytes);
  const auto seed = static_cast<unsigned>(g_random.next());
  input.resize(target.of_files ? LLVMFuzzerCustomMutator(input.data(), size, input.size(), seed)
                               : LLVMFuzzerMutate(input.data(), size, input.size()));
  return input;
}

}  // namespace

// Of libFuzzer, for file_mutator.cpp: a few edits at random.
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size) {
  if (max_size == 0) return 0;
  for (std::uint64_t n = 1 + g_random.below(4); n > 0; --n) {
    if (size < max_size && (size == 0 || g_random.one_in(8))) {
      data[size++] = static_cast<std::uint8_t>(g_random.next());
      continue;
    }
    const std::size_t at = g_random.below(size);
    if (g_random.one_in(2)) data[at] = static_cast<std::uint8_t>(data[at] ^ 1u << g_random.below(8));
    if (g_random.one_in(3)) data[at] = static_cast<std::uint8_t>(g_random.next());
    if (g_random.one_in(8)) data[at] = g_random.one_in(2) ? std::uint8_t{0} : std::uint8_t{0xff};
    if (size > 1 && g_random.one_in(32)) size -= g_random.below(size / 2);
  }
  return size;
}

int main(int argc, char** argv) {
  std::size_t all = 0, mutations = 0;
  std::string only;
  std::vector<std::filesystem::path> folders;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == "--mutations" && i + 1 < argc) {
      mutations = std::strtoull(argv[++i], nullptr, 10);
    } else if (argument == "--only" && i + 1 < argc) {
      only = argv[++i];
    } else {
      folders.emplace_back(argument);
    }
  }
  for (const Target& target : kTargets) {
    if (!only.empty() && only != target.name) continue;
    std::vector<Bytes> inputs;
    for (const auto& folder : folders) {
      for (Bytes& input : inputs_of(folder / target.name)) inputs.push_back(std::move(input));
    }
    for (const Bytes& input : inputs) {
      keep(input);
      target.run(input.data(), input.size());
    }
    g_random = Random(1);
    for (std::size_t n = 0; n < mutations && !inputs.empty(); ++n) {
      // Mutations of mutations now and then: some rules need two changes.
      Bytes& from = inputs[g_random.below(inputs.size())];
      Bytes input = mutated(target, from);
      keep(input);
      target.run(input.data(), input.size());
      if (g_random.one_in(16)) from = std::move(input);
    }
    std::printf("%zu inputs of %s, %zu mutations\n", inputs.size(), target.name,
                inputs.empty() ? 0 : mutations);
    std::fflush(stdout);
    all += inputs.size();
  }
  std::filesystem::remove("replay-last");
  return all == 0 ? 1 : 0;
}
