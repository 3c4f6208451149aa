// Wavelengths in the names of channels of spectral images.
#pragma once
#include <span>
#include <string>
#include <vector>

namespace btfc {

// Nanometres, 100 … 20000, that the names state, in their order: "550.5", "550 nm", "w550", "S0.550,500nm",
// with one and the same text before the number in all. Empty where they state none.
std::vector<double> wavelengths_of(std::span<const std::string> names);

}  // namespace btfc
