// btfc_fuzz_replay FOLDER...: every fuzz target over the inputs in FOLDER/<target>, without libFuzzer. What
// does not hold ends the program. A folder may have inputs of some targets only.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

// Each target's file is compiled with LLVMFuzzerTestOneInput renamed to one of these.
extern "C" {
int btfc_fuzz_open(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_chunk(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_params(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_decode(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_api(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_differential(const std::uint8_t* data, std::size_t size);
int btfc_fuzz_round_trip(const std::uint8_t* data, std::size_t size);
}

namespace {

struct Target {
  const char* name;
  int (*run)(const std::uint8_t*, std::size_t);
};

constexpr Target kTargets[] = {{"open", btfc_fuzz_open},
                               {"chunk", btfc_fuzz_chunk},
                               {"params", btfc_fuzz_params},
                               {"decode", btfc_fuzz_decode},
                               {"api", btfc_fuzz_api},
                               {"differential", btfc_fuzz_differential},
                               {"round_trip", btfc_fuzz_round_trip}};

std::vector<std::filesystem::path> inputs_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> paths;
  if (!std::filesystem::is_directory(folder)) return paths;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t all = 0;
  for (const Target& target : kTargets) {
    std::size_t count = 0;
    for (int i = 1; i < argc; ++i) {
      for (const auto& path : inputs_of(std::filesystem::path(argv[i]) / target.name)) {
        std::ifstream in(path, std::ios::binary);
        const std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
        // Said before it runs: where it ends the program, this is the input.
        std::printf("%s\r", path.c_str());
        std::fflush(stdout);
        // A copy of exactly its size, so that a read beyond it is noticed.
        std::vector<std::uint8_t> data(bytes.begin(), bytes.end());
        target.run(data.data(), data.size());
        ++count;
      }
    }
    std::printf("%zu inputs of %s\n", count, target.name);
    all += count;
  }
  return all == 0 ? 1 : 0;
}
