// What the C++ tests share: small inputs, files made of them, and ways to damage files.
#pragma once
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "btfc/btfc.hpp"
#include "encoder/image.h"
#include "encoder/model_table.h"
#include "tests/damaged_file.h"
#include "tools/texture_file.h"

namespace btfc::test {

// Texels of independent noise; float16 values are finite, of both signs, subnormals and 65504 among them.
Image noise(std::uint32_t width, std::uint32_t height, std::uint32_t channels, SampleType type,
            std::uint64_t seed = 1);

// An image of one code.
Image constant(std::uint32_t width, std::uint32_t height, std::uint32_t channels, SampleType type,
               std::uint16_t code);

// A procedural material (btfc synth).
Image material(const char* kind, std::uint32_t width, std::uint32_t height,
               SampleType type = SampleType::unorm8);

// Fits a model to one map and packs the file; the test fails where that fails.
Bytes encode(const char* model, const Image& image, const OptionValues& options, Codec codec = Codec::raw,
             unsigned threads = 1);
Bytes pack(const FitResult& fit, Codec codec = Codec::raw);
FitResult fit(const char* model, const Image& image, const OptionValues& options, unsigned threads = 1);

// Every committed vector of a model; each model has some.
std::vector<std::filesystem::path> vectors_of(const char* model);

// How far decoders of an unbounded file may be from what it stands for, as its PARM says (spec/models/car.md
// 1); 0 of all other files.
double stated_error(const Bytes& file);

// The decoder's texture of a file in memory; empty where it is refused.
TexturePtr load(const Bytes& file, btfc_error* error = nullptr);

// All maps' codes as a decoder gives them.
std::vector<Image> decode(const Bytes& file);

}  // namespace btfc::test
