// How fast a texture is decoded, beside plain look-ups of what it decodes to.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "btfc/btfc.h"
#include "format/result.h"
#include "tools/vulkan_decoder.h"

namespace btfc {

struct RateOptions {
  double seconds = 0.4;  // for each measure
  float footprint = 1;
  unsigned threads = 1;   // of `full`; all else has one
  bool reference = true;  // whether `naive` is measured
};

// Texels a second, medians over turns. Of a BTF full and naive are under one pair of directions that was not
// measured, random and batch under random ones.
struct DecodeRates {
  double full = 0;    // whole images
  double random = 0;  // random texels, one a call
  double batch = 0;   // random texels, one call
  double naive = 0;   // the reference, texel by texel
  double copy = 0;    // memcpy of as many bytes as `full` writes
  double lookup = 0;  // random texels of the uncompressed image
};
DecodeRates measure_rates(const btfc_texture* texture, std::uint32_t map, const RateOptions& options);

// The shader's rates beside plain fetches, in eight times the seconds. Nothing where there is no device,
// unless it is `demanded`.
struct DeviceRates {
  std::string device;
  ShaderRates rates;
};
Result<std::optional<DeviceRates>> measure_shader_rates(const btfc_texture* texture, std::uint32_t map,
                                                        const RateOptions& options, bool demanded);

}  // namespace btfc
