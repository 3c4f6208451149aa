// Blocks of images in parallel; in a block tiles of texels, as large as the second-level cache likes.
#include "encoder/input/ubo2014_expand.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

#include "encoder/for_each_index.h"
#include "encoder/input/ubo2014_product.h"

namespace btfc {
namespace {

constexpr std::size_t kBlockBytes = 32u << 20;  // images of a block
constexpr float kHalfLimit = 65520;             // from here on halves are infinite
constexpr std::size_t kTileFloats = 1u << 15;   // of a tile's texels, or of its sums

// A run of images with the same factors.
struct Block {
  std::size_t group = 0;
  std::size_t first = 0;  // direction in the group
  std::size_t count = 0;
  std::size_t pair = 0;  // of the first direction
};

std::vector<Block> blocks_of(const Ubo2014Header& header, const Ubo2014Factored& body,
                             std::size_t image_bytes) {
  const std::size_t size = std::clamp<std::size_t>(kBlockBytes / image_bytes, 1, kUbo2014Directions);
  const std::size_t groups = body.group_a_view ? header.views.size() : 1;
  const std::size_t directions = header.pairs() / groups;
  std::vector<Block> blocks;
  for (std::size_t g = 0; g < groups; ++g) {
    for (std::size_t d = 0; d < directions; d += size) {
      blocks.push_back({g, d, std::min(size, directions - d), g * directions + d});
    }
  }
  return blocks;
}

// A thread's buffers.
struct Workspace {
  std::vector<float> row, texels, sums;
  std::vector<std::vector<float>> directions;  // of each channel
  std::vector<std::uint16_t> codes, images;
};

class Expander {
 public:
  Expander(const Ubo2014File& file, const Ubo2014Header& header, const Ubo2014Factored& body,
           const Rectangle& crop, Dataset& dataset)
      : bytes_(file.bytes()), header_(header), body_(body), crop_(crop), dataset_(dataset) {
    std::size_t components = 0;
    for (const Ubo2014Factors& each : body.factors) {
      components = std::max(components, component_count(each));
    }
    const std::size_t floats = std::max(components, channels() * kUbo2014Directions);
    tile_ = std::clamp<std::size_t>(kTileFloats / floats, 4, 1024) / 4 * 4;
  }

  // The images of a block, or the sentence about the first value that cannot be kept.
  std::optional<std::string> expand(const Block& block, Workspace& space, std::uint64_t& negative) const {
    const std::size_t texels = std::size_t{crop_.width} * crop_.height;
    load_directions(block, space);
    space.sums.resize(channels() * tile_ * kUbo2014Directions);
    space.codes.resize(space.sums.size());
    space.images.resize(block.count * texels * channels());
    for (std::size_t t = 0; t < texels; t += tile_) {
      const std::size_t count = std::min(tile_, texels - t);
      const std::size_t stride = count * kUbo2014Directions;
      for (std::size_t c = 0; c < channels(); ++c) multiply(block, c, t, count, space);
      // A component that is not finite shows in the sum; in an exponential it may not.
      if (auto fault = find_fault(block, t, count, space, std::numeric_limits<float>::infinity())) {
        return fault;
      }
      ubo2014_to_linear(body_.colour, channels(), stride, stride, space.sums.data());
      if (auto fault = find_fault(block, t, count, space, kHalfLimit)) return fault;
      ubo2014_to_half(space.sums.data(), channels() * stride, space.codes.data());
      negative += deal_out(block, t, count, texels, space);
    }
    const std::span<const std::uint16_t> images(space.images);
    for (std::size_t d = 0; d < block.count; ++d) {
      dataset_.write_image(block.pair + d, images.subspan(d * texels * channels(), texels * channels()));
    }
    return std::nullopt;
  }

 private:
  std::size_t channels() const { return header_.channels.size(); }

  // The tile's codes into the images; returns how many are below 0.
  std::uint64_t deal_out(const Block& block, std::size_t t, std::size_t count, std::size_t texels,
                         Workspace& space) const {
    std::uint64_t negative = 0;
    for (std::size_t c = 0; c < channels(); ++c) {
      for (std::size_t d = 0; d < block.count; ++d) {
        const std::uint16_t* from = space.codes.data() + c * count * kUbo2014Directions + d;
        std::uint16_t* to = space.images.data() + (d * texels + t) * channels() + c;
        for (std::size_t i = 0; i < count; ++i) {
          to[i * channels()] = from[i * kUbo2014Directions];
          negative += from[i * kUbo2014Directions] > 0x8000u ? 1u : 0u;
        }
      }
    }
    return negative;
  }

  // The mean is one component more, with 1 in the other factor.
  static std::size_t component_count(const Ubo2014Factors& factors) {
    return factors.directions.matrix.components + (factors.has_mean == Ubo2014Factors::Mean::none ? 0u : 1u);
  }

  void load(const Ubo2014Rows& rows, std::uint64_t row, float* to) const {
    ubo2014_load_scalars(bytes_.data() + rows.offset(row), rows.matrix.scalar_bytes, rows.matrix.components,
                         to);
  }

  // A row with its mean or 1.
  void load_with_mean(const Ubo2014Factors& factors, const Ubo2014Rows& rows, Ubo2014Factors::Mean own,
                      std::uint64_t row, float* to) const {
    load(rows, row, to);
    if (factors.has_mean == Ubo2014Factors::Mean::none) return;
    float& last = to[rows.matrix.components];
    last = 1;
    if (factors.has_mean == own) load(factors.mean, row, &last);
  }

  // Components of the block's directions, transposed.
  void load_directions(const Block& block, Workspace& space) const {
    space.directions.resize(channels());
    for (std::size_t c = 0; c < channels(); ++c) {
      const Ubo2014Factors& factors = body_.factors[block.group * channels() + c];
      const std::size_t components = component_count(factors);
      space.row.resize(components);
      space.directions[c].assign(components * kUbo2014Directions, 0.0f);
      for (std::size_t d = 0; d < block.count; ++d) {
        load_with_mean(factors, factors.directions, Ubo2014Factors::Mean::of_direction, block.first + d,
                       space.row.data());
        for (std::size_t k = 0; k < components; ++k) {
          space.directions[c][k * kUbo2014Directions + d] = space.row[k];
        }
      }
    }
  }

  // Texel of the file at place t of the crop.
  std::uint64_t texel_at(std::size_t t) const {
    return std::uint64_t{crop_.y + t / crop_.width} * header_.width + crop_.x + t % crop_.width;
  }

  void multiply(const Block& block, std::size_t c, std::size_t t, std::size_t count, Workspace& space) const {
    const Ubo2014Factors& factors = body_.factors[block.group * channels() + c];
    const std::size_t components = component_count(factors);
    space.texels.resize(count * components);
    for (std::size_t i = 0; i < count; ++i) {
      load_with_mean(factors, factors.texels, Ubo2014Factors::Mean::of_texel, texel_at(t + i),
                     space.texels.data() + i * components);
    }
    ubo2014_product(space.texels.data(), count, components, space.directions[c].data(),
                    space.sums.data() + c * count * kUbo2014Directions);
  }

  // The first of the tile's values that is not below the limit in magnitude.
  std::optional<std::string> find_fault(const Block& block, std::size_t t, std::size_t count,
                                        const Workspace& space, float limit) const {
    const std::size_t stride = count * kUbo2014Directions;
    const std::span<const float> sums(space.sums.data(), channels() * stride);
    unsigned bad = 0;
    for (const float v : sums) bad |= std::fabs(v) < limit ? 0u : 1u;
    if (bad == 0) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t d = 0; d < block.count; ++d) {
        for (std::size_t c = 0; c < channels(); ++c) {
          const float v = sums[c * stride + i * kUbo2014Directions + d];
          if (std::fabs(v) < limit) continue;
          return fmt::format("{} is {}, expected finite values up to 65504",
                             ubo2014_place(header_, block.pair + d, texel_at(t + i), c), v);
        }
      }
    }
    return std::nullopt;  // in a direction that fills the block up
  }

  ByteView bytes_;
  const Ubo2014Header& header_;
  const Ubo2014Factored& body_;
  Rectangle crop_;
  Dataset& dataset_;
  std::size_t tile_ = 4;
};

}  // namespace

std::string ubo2014_place(const Ubo2014Header& header, std::size_t pair, std::uint64_t texel,
                          std::size_t channel) {
  const std::size_t view = pair / header.lights.size(), light = pair % header.lights.size();
  return fmt::format("view {} {}, light {} {}, texel ({}, {}), channel '{}'", view,
                     to_text(header.views[view]), light, to_text(header.lights[light]), texel % header.width,
                     texel / header.width, header.channels[channel]);
}

Result<std::uint64_t> expand_ubo2014(const Ubo2014File& file, const Ubo2014Header& header,
                                     const Ubo2014Factored& body, const Rectangle& crop,
                                     const DatasetReadOptions& options, Dataset& dataset) {
  const std::vector<Block> blocks = blocks_of(header, body, dataset.info().image_samples() * 2);
  const Expander expander(file, header, body, crop, dataset);
  tbb::enumerable_thread_specific<Workspace> workspaces;
  std::mutex lock;
  std::size_t done = 0;
  std::uint64_t negatives = 0;
  const Result<Done> expanded = for_each_index(blocks.size(), [&](std::size_t b) -> Result<Done> {
    std::uint64_t negative = 0;
    const std::optional<std::string> fault = expander.expand(blocks[b], workspaces.local(), negative);
    if (fault) return bad_data(fmt::format("'{}': {}", file.path(), *fault));
    const std::lock_guard<std::mutex> hold(lock);
    negatives += negative;
    done += blocks[b].count;  // images, of which blocks have different numbers
    if (options.progress) options.progress(done, header.pairs());
    return Done{};
  });
  if (!expanded) return expanded.error();
  return negatives;
}

}  // namespace btfc
