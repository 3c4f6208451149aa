// What a decoder may choose anew each time it loads a file: how much of it is read and how closely it is
// followed.
#pragma once
#include <cstdint>
#include <tuple>

namespace btfc {

// As btfc_selection has them; 0 means what the file and the decoder do by themselves.
struct Knobs {
  std::uint32_t levels = 0;  // how many, the coarsest counted
  std::uint32_t gates = 0;   // of gm: the K highest count
  float culling = 0;         // of gm: the share of the weights that may be left out
  bool operator==(const Knobs&) const = default;
  auto order() const { return std::tuple(levels, gates, culling); }
};

}  // namespace btfc
