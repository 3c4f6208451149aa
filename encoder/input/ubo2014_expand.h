// Factored BTFs multiplied out onto a data set.
#pragma once
#include <string>

#include "encoder/dataset/dataset.h"
#include "encoder/input/dataset_read.h"
#include "encoder/input/ubo2014_factors.h"

namespace btfc {

// The texels of `crop` for all pairs, onto a float16 data set of their size, whose pairs are the full
// product. Values below 0, which a factorisation may give, are kept; those that are not finite or beyond
// half's range are an error that names the first. Sums run in single precision over the components in order,
// so that the result does not depend on the threads. Holds up to 32 images, or 32 MiB of them, a thread.
// Returns the number of values below 0.
Result<std::uint64_t> expand_ubo2014(const Ubo2014File& file, const Ubo2014Header& header,
                                     const Ubo2014Factored& body, const Rectangle& crop,
                                     const DatasetReadOptions& options, Dataset& dataset);

// "view 3 (30, 120), light 5 (45, 0), texel (7, 2), channel 'R'", for messages about a value.
std::string ubo2014_place(const Ubo2014Header& header, std::size_t pair, std::uint64_t texel,
                          std::size_t channel);

}  // namespace btfc
