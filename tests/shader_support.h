// What the tests of the shaders share: a device or a reason to skip, and differences between CPU and shader.
#pragma once
#include <random>
#include <span>
#include <string>
#include <vector>

#include "btfc/btfc.h"
#include "tools/vulkan_decoder.h"

namespace btfc::test {

// Why there is no device for the shaders here; empty where there is one.
const std::string& why_no_shaders();

// Whether the validation layer is there.
bool validation_installed();

struct Difference {
  std::size_t values = 0, differing = 0;
  double rmse = 0, worst = 0;  // over max(1, size of the value)
};

// expected: `channels` floats a query; got: four.
Difference difference(std::span<const float> expected, std::span<const float> got, std::uint32_t channels);

// The tolerance of a model's shader against the CPU, in values: 0 exactly.
double shader_tolerance(const std::string& model, double stated_error);

// Any directions of the sphere, those below the horizon too; footprints and levels; texels within and around
// the texture. Of an unbounded texture within a window, at every level.
std::vector<btfc_query> random_queries(const btfc_texture* texture, std::uint32_t map,
                                       const btfc_gpu_window& window, std::size_t count,
                                       std::uint32_t seed = 1);

// btfc_eval of the CPU, one thread.
std::vector<float> cpu_values(const btfc_texture* texture, std::uint32_t map,
                              std::span<const btfc_query> queries);
std::vector<float> cpu_rectangle(const btfc_texture* texture, std::uint32_t map,
                                 const btfc_directions& directions, std::int32_t x, std::int32_t y,
                                 std::uint32_t width, std::uint32_t height);

// The window that a test prepares: of unbounded textures a little more than the tile, otherwise none.
btfc_gpu_window window_for(const btfc_texture* texture);

}  // namespace btfc::test
