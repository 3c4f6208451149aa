// Damaged files for btfc_mutate: what a seed file is, and how a numbered mutation changes one.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "format/container.h"

namespace btfc::test {

// splitmix64: cheap to seed, so that every mutation has a state of its own and can be made again alone.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next();
  // 0 … bound - 1; 0 where bound is 0.
  std::uint64_t below(std::uint64_t bound) { return bound == 0 ? 0 : next() % bound; }
  bool one_in(std::uint64_t n) { return below(n) == 0; }

 private:
  std::uint64_t state_;
};

struct Seed {
  std::string name;
  Bytes file;
  std::vector<RawChunk> chunks;
};

// An error where the file is not valid.
Result<Seed> make_seed(std::string name, Bytes file);

enum class Damage {
  bytes,     // of the file as it lies, hashes left alone: what a disk or a network does
  repaired,  // the same, then every hash made right: the damage reaches the rules and the evaluation
  reshaped   // HEAD and PARM changed, chunks resized to what their formulas then ask for
};
inline constexpr int kDamageKinds = 3;

// A file of these chunks that keeps the rules about sizes, with other parameters. Empty where no try gave
// one.
Bytes reshape(Random& random, const std::vector<RawChunk>& chunks);

struct Mutant {
  Bytes file;
  Damage damage = Damage::bytes;
  std::size_t seed = 0;  // which of the seeds
};

// The mutation with that number: the same for the same seeds, run and number.
Mutant mutate(const std::vector<Seed>& seeds, std::uint64_t run, std::uint64_t number);

}  // namespace btfc::test
