// Sums over very many samples, as the fits and measures take them, against what is known in closed form.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace btfc::test {

struct Accumulation {
  std::string models;  // whose fit takes it
  std::string name, unit;
  double error = 0, bound = 0;  // relative
  double samples = 0;           // that were added up
};

// Streams of a constant with tiny offsets, some `samples` long where they need not be held, else fewer: what
// is looked for is far below the constant.
std::vector<Accumulation> accumulations(std::uint64_t samples);

}  // namespace btfc::test
