// Synthetic BTFs: the relief, what lights do to it, what views see of it, in batches that fit the memory.
#include "encoder/synth/btf_synth.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <vector>

#include "encoder/synth/btf_light.h"
#include "encoder/synth/btf_relief.h"
#include "encoder/synth/btf_shade.h"
#include "encoder/synth/btf_surface.h"

namespace btfc {
namespace {

using namespace procedural;

constexpr std::array<BtfKind, 6> kKinds{{
    {"weave", "plain weave of coarse two-ply yarns, indigo on ecru, yarns of about 11 texels"},
    {"knit", "stockinette of plied wool, stitches of about 16 x 12 texels"},
    {"corduroy", "velvet ribs of about 16 texels with tufted pile"},
    {"leather", "grained leather with creases and gloss, cells of about 9 texels"},
    {"plaster", "rough plaster with sand, pits and trowel strokes"},
    {"brushed", "brushed metal, streaks along x: strongly anisotropic"},
}};
constexpr std::array<Surface (*)(const Tile&), kKinds.size()> kSurfaces{weave,   knit,    corduroy,
                                                                        leather, plaster, brushed};

// Light maps of one batch of lights, bytes.
constexpr std::size_t kBatchBytes = std::size_t{256} << 20;
// Texels shaded at once: their values of all lights stay in the cache.
constexpr std::uint32_t kRun = 32;

Result<Relief> relief_of(std::string_view kind, const BtfSynthOptions& options) {
  const auto found =
      std::find_if(kKinds.begin(), kKinds.end(), [&](const BtfKind& k) { return k.name == kind; });
  if (found == kKinds.end()) {
    std::string names;
    for (const BtfKind& k : kKinds) names += std::string(names.empty() ? "" : ", ") + k.name;
    return bad_argument(fmt::format("no BTF kind is named '{}'; the kinds are {}", kind, names));
  }
  if (options.width == 0 || options.height == 0 ||
      std::uint64_t{options.width} * options.height > kMaxSynthTexels) {
    return bad_argument(
        fmt::format("a synthetic BTF of {}x{} texels, expected at least 1x1 and at most {} texels",
                    options.width, options.height, kMaxSynthTexels));
  }
  const Tile tile{static_cast<double>(options.width), static_cast<double>(options.height),
                  Noise(options.seed)};
  const Surface surface = kSurfaces[static_cast<std::size_t>(found - kKinds.begin())](tile);
  return sample_relief(surface, options.width, options.height);
}

Error no_memory(const BtfSynthOptions& options) {
  return {Status::out_of_memory,
          fmt::format("no memory for a synthetic BTF of {}x{} texels", options.width, options.height), "", 0};
}

// Linear values to codes: a table for 8 bits, where the curve would cost more than the shading.
class Coder {
 public:
  explicit Coder(SampleType type) : type_(type) {
    if (type != SampleType::unorm8) return;
    for (std::size_t i = 0; i < table_.size(); ++i) {
      table_[i] = static_cast<std::uint8_t>(encode(type, static_cast<double>(i) / kTop));
    }
  }
  std::uint16_t operator()(float linear) const {
    if (type_ != SampleType::unorm8) {
      return static_cast<std::uint16_t>(btfc_float_to_half(std::clamp(linear, 0.0f, 65504.0f)));
    }
    return table_[static_cast<std::size_t>(std::clamp(linear, 0.0f, 1.0f) * kTop + 0.5f)];
  }

 private:
  static constexpr std::uint32_t kTop = 65535;  // steps of at most 0.05 codes
  SampleType type_;
  std::array<std::uint8_t, kTop + 1> table_{};
};

// All images of one view under the lights first … first + lights.size() - 1.
void photograph(const Relief& relief, const LightMaps& maps, std::span<const ReliefDirection> lights,
                std::size_t first, std::size_t view, const ReliefDirection& towards, const Coder& coder,
                Dataset& dataset) {
  const DatasetInfo& info = dataset.info();
  const std::size_t samples = info.image_samples();
  std::vector<std::uint16_t> codes(samples * lights.size());
  std::vector<float> values(std::size_t{kRun} * 3 * lights.size());
  for (std::uint32_t y = 0; y < info.height; ++y) {
    for (std::uint32_t x = 0; x < info.width; x += kRun) {
      const std::uint32_t count = std::min(kRun, info.width - x);
      shade_texels(relief, maps, lights, towards, x, y, count, values);
      const std::size_t begin = (std::size_t{y} * info.width + x) * 3;
      for (std::size_t l = 0; l < lights.size(); ++l) {
        std::uint16_t* image = codes.data() + samples * l + begin;
        for (std::size_t i = 0; i < std::size_t{count} * 3; ++i)
          image[i] = coder(values[i * lights.size() + l]);
      }
    }
  }
  for (std::size_t l = 0; l < lights.size(); ++l) {
    dataset.write_image(view * info.lights.size() + first + l,
                        std::span(codes).subspan(samples * l, samples));
  }
}

}  // namespace

std::span<const BtfKind> btf_kinds() { return kKinds; }

Result<Dataset> synthesize_btf(std::string_view kind, const BtfSynthOptions& options) {
  if (options.directions != 81 && options.directions != 151) {
    return bad_argument(
        fmt::format("a synthetic BTF of {} directions, expected 81 or 151", options.directions));
  }
  if (options.type != SampleType::unorm8 && options.type != SampleType::float16) {
    return bad_argument("a synthetic BTF's sample type must be unorm8 or float16");
  }
  try {
    const Result<Relief> relief = relief_of(kind, options);
    if (!relief) return relief.error();
    DatasetInfo info;
    info.width = options.width;
    info.height = options.height;
    info.channels = {"R", "G", "B"};
    info.type = options.type;
    info.colour_space =
        options.type == SampleType::float16 ? ColourSpace::lin_rec709_scene : ColourSpace::srgb_rec709_scene;
    info.quantity = Quantity::reflectance_cos;
    info.wraps = true;
    info.views = options.directions == 81 ? ubo2003_directions() : ubo2014_directions();
    info.lights = info.views;
    make_full_product(info);
    Result<Dataset> dataset = Dataset::create(std::move(info), options.scratch_directory);
    if (!dataset) return dataset.error();

    std::vector<ReliefDirection> directions;
    for (const Direction& d : dataset->info().views) directions.push_back(relief_direction(d));
    const BounceRays rays(*relief);
    const Coder coder(options.type);
    const std::size_t total = directions.size() * directions.size();
    const std::size_t light_bytes = relief->size() * 5 * sizeof(float);
    const std::size_t batch = std::clamp<std::size_t>(kBatchBytes / light_bytes, 1, directions.size());
    std::mutex lock;
    std::size_t done = 0;
    for (std::size_t first = 0; first < directions.size(); first += batch) {
      const auto lights = std::span(directions).subspan(first, std::min(batch, directions.size() - first));
      const LightMaps maps = light_maps(*relief, rays, lights);
      tbb::parallel_for(std::size_t{0}, directions.size(), [&](std::size_t view) {
        photograph(*relief, maps, lights, first, view, directions[view], coder, *dataset);
        const std::lock_guard<std::mutex> hold(lock);
        done += lights.size();
        if (options.progress) options.progress(done, total);
      });
    }
    return dataset;
  } catch (const std::bad_alloc&) {
  } catch (const std::length_error&) {
  }
  return no_memory(options);
}

Result<BtfGroundTruth> btf_ground_truth(std::string_view kind, const BtfSynthOptions& options) {
  try {
    const Result<Relief> relief = relief_of(kind, options);
    if (!relief) return relief.error();
    BtfGroundTruth truth;
    truth.height.type = SampleType::float16;
    truth.height.channels = 1;
    truth.normals.type = SampleType::unorm16;
    truth.normals.channels = 3;
    for (Image* image : {&truth.height, &truth.normals}) {
      image->width = options.width;
      image->height = options.height;
      image->colour_space = ColourSpace::data;
      image->codes.resize(std::size_t{options.width} * options.height * image->channels);
    }
    for (std::uint32_t y = 0; y < options.height; ++y) {
      for (std::uint32_t x = 0; x < options.width; ++x) {
        double h = 0, sx = 0, sy = 0;
        for (std::uint32_t k = 0; k < kReliefSteps * kReliefSteps; ++k) {
          const std::size_t row = std::size_t{y} * kReliefSteps + k / kReliefSteps;
          const std::size_t q = row * relief->columns + x * kReliefSteps + k % kReliefSteps;
          h += static_cast<double>(relief->height[q]);
          sx += static_cast<double>(relief->slope_x[q]);
          sy += static_cast<double>(relief->slope_y[q]);
        }
        constexpr double kShare = 1.0 / (kReliefSteps * kReliefSteps);
        // Heights in grid steps to texels; rows go down, y up.
        truth.height.at(x, y, 0) =
            static_cast<std::uint16_t>(btfc_float_to_half(static_cast<float>(h * kShare / kReliefSteps)));
        const double nx = -sx * kShare, ny = sy * kShare, scale = 1 / std::sqrt(nx * nx + ny * ny + 1);
        const std::array<double, 3> n{nx * scale, ny * scale, scale};
        for (std::uint32_t c = 0; c < 3; ++c) {
          truth.normals.at(x, y, c) = static_cast<std::uint16_t>((n[c] * 0.5 + 0.5) * 65535 + 0.5);
        }
      }
    }
    return truth;
  } catch (const std::bad_alloc&) {
  } catch (const std::length_error&) {
  }
  return no_memory(options);
}

}  // namespace btfc
