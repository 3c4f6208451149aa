// Small BTFs made up by formula, and files made of them, for the tests of models of directions.
#pragma once
#include <array>
#include <functional>
#include <random>
#include <string>

#include "encoder/dataset/dataset.h"
#include "format/coded_rows.h"
#include "format/directions.h"
#include "tests/test_support.h"

namespace btfc::test {

// The normal and rings of 6, 12, 18 … directions, 15 degrees apart, up to so many rings (0 … 5).
std::vector<Direction> rings(int count);

// A full product of views and lights.
DatasetInfo btf_info(std::uint32_t width, std::uint32_t height, std::uint32_t channels, SampleType type,
                     std::vector<Direction> views, std::vector<Direction> lights);

using Value = std::function<double(const Direction& view, const Direction& light, std::uint32_t x,
                                   std::uint32_t y, std::uint32_t channel)>;

// Values are rounded to the set's codes; unorm ones clamped to 0 … 1.
Dataset make_btf(DatasetInfo info, const Value& value);

// Rough, shiny, varying from texel to texel: no model of low rank shows it exactly.
double bumpy(const Direction& view, const Direction& light, std::uint32_t x, std::uint32_t y,
             std::uint32_t channel);

FitResult fit(const char* model, const Dataset& dataset, const OptionValues& options, unsigned threads = 1);
Bytes encode(const char* model, const Dataset& dataset, const OptionValues& options, Codec codec = Codec::raw,
             unsigned threads = 1);

// Root of the mean squared difference between a set and a file's values at the set's own directions, over all
// samples, values not rounded. Fails the test where a value is no number.
double rmse(const Dataset& dataset, const Bytes& file, const btfc_selection* selection = nullptr);

// A HEAD with one to three maps, 1 to 12 texels a side and 1 to 6 views and lights, and directions for it;
// pairs are missing from half of them.
struct RandomBtf {
  Head head;
  Directions directions;
};
RandomBtf random_btf(ModelId model, std::mt19937& random);
CodedRows random_rows(std::mt19937& random, std::uint64_t rows, std::uint64_t columns, Precision precision);

// A file of these chunks is valid and keeps them, holds what the formula says, and takes memory_bits once
// loaded; the test fails where it does not.
void check_sizes(const Head& head, const std::vector<RawChunk>& chunks, std::uint64_t formula_bits,
                 std::uint64_t memory_bits);

// The fast rows of a file and the reference give the same bits, under directions that were not measured.
void check_fast_rows(const std::vector<RawChunk>& chunks);

// What the file answers to one query of map 0.
std::array<float, 4> value_at(const btfc_texture* texture, std::int32_t x, std::int32_t y,
                              const float (&view)[3], const float (&light)[3]);

}  // namespace btfc::test
