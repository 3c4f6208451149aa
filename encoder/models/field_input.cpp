// Images or a data set -> subspaces, range map, planes.
#include "encoder/models/field_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "encoder/dataset/dataset_head.h"
#include "encoder/fields/relief_strength.h"
#include "encoder/range/range_map.h"
#include "encoder/segment/missing_pairs.h"
#include "encoder/segment/subspaces.h"
#include "format/limits.h"
#include "format/models/field_options.h"

namespace btfc {
namespace {

std::vector<FieldPlane> planes_of(const Image& image) {
  std::vector<FieldPlane> planes(image.channels, {image.width, image.height, {}});
  for (FieldPlane& plane : planes) plane.values.reserve(std::size_t{image.width} * image.height);
  for (std::size_t i = 0; i < image.codes.size(); ++i)
    planes[i % image.channels].values.push_back(double{code_value(image.type, image.codes[i])});
  return planes;
}

// Images: one subspace, one pair, no relief.
Result<FieldInput> input_of_images(ModelId model, const std::vector<NamedImage>& maps,
                                   const OptionValues& options) {
  for (const char* name : {"clusters", "range", "range-bits"}) {
    if (find_option(options, name))
      return bad_argument(fmt::format("--{} is for data sets of several directions, not for images", name));
  }
  FieldInput out;
  out.head.model = model;
  out.head.width = maps[0].image.width;
  out.head.height = maps[0].image.height;
  out.channels.emplace_back();
  for (const NamedImage& map : maps) {
    const Image& image = map.image;
    if (image.width != out.head.width || image.height != out.head.height) {
      return bad_argument(fmt::format("map '{}' has {}x{} texels, expected {}x{} as '{}'", map.name,
                                      image.width, image.height, out.head.width, out.head.height,
                                      maps[0].name));
    }
    if (image.width > kMaxSide || image.height > kMaxSide)
      return bad_argument(fmt::format("map '{}' has {}x{} texels, expected at most {} a side", map.name,
                                      image.width, image.height, kMaxSide));
    out.head.maps.push_back({map.name, image.channels, image.type, image.colour_space, image.alpha});
    for (FieldPlane& plane : planes_of(image)) out.channels[0].push_back(std::move(plane));
  }
  if (out.head.channels() > kMaxChannels)
    return bad_argument(fmt::format("{} channels, expected at most {}", out.head.channels(), kMaxChannels));
  out.payload.directions = {{DirectionPoint{}}, {DirectionPoint{}}, {{0, 0}}};
  out.payload.subspace_of_pair = {0};
  return out;
}

// Heights as codes; a step of 0 where the ground is level.
void code_range(const RangeMap& map, const FieldShape& shape, FieldInput& out) {
  const auto [low, high] = std::minmax_element(map.heights.begin(), map.heights.end());
  const std::uint32_t most = shape.range_bits == 8 ? 255 : 65535;
  out.range_width = map.width;
  out.range_height = map.height;
  out.range_bits = shape.range_bits;
  out.payload.height_step = (*high - *low) / static_cast<float>(most);
  for (const float h : map.heights) {
    const float code = out.payload.height_step > 0 ? (h - *low) / out.payload.height_step : 0;
    out.payload.range.push_back(
        static_cast<std::uint16_t>(std::lround(std::clamp(code, 0.0f, static_cast<float>(most)))));
  }
}

}  // namespace

Result<FieldInput> field_input(ModelId model, const FitInput& input, const FitSettings& settings) {
  if (input.dataset == nullptr) return input_of_images(model, input.maps, settings.options);
  const Dataset& dataset = *input.dataset;
  Result<DatasetHead> described = dataset_head(dataset.info(), model);
  if (!described) return described.error();
  FieldInput out;
  out.head = described->head;
  out.payload.directions = std::move(described->directions);
  out.wraps = dataset.info().wraps;
  const auto wanted = parse_automatic(settings.options, "clusters", 1, kFieldMostClusters);
  if (!wanted) return wanted.error();
  Result<Subspaces> subspaces = segment_pairs(dataset, wanted->value_or(0), settings.seed, settings.progress);
  if (!subspaces) return subspaces.error();
  out.payload.subspace_of_pair = std::move(subspaces->of_pair);
  out.report.push_back({"segmentation_explains", fmt::format("{:.4f}", subspaces->explained)});

  if (settings.reconstruct_missing && !dataset.info().full_product()) {
    const std::size_t measured = out.head.pairs;
    out.payload.subspace_of_pair = complete_index(dataset, out.payload.subspace_of_pair, subspaces->medoid);
    out.head.pairs = out.head.views * out.head.lights;
    out.payload.directions.pairs = all_pairs(out.head.views, out.head.lights);
    out.report.push_back({"reconstructed_pairs", std::to_string(out.head.pairs - measured)});
  }

  const Result<FieldShape> shape = field_shape_from_options(settings.options, out.head, 1, 0);
  if (!shape) return shape.error();
  for (const std::size_t pair : subspaces->medoid) out.channels.push_back(planes_of(dataset.image(pair)));
  if (shape->range_bits == 0) return out;
  const Result<RangeMap> range = estimate_range_map(dataset, shape->range_width, shape->range_height);
  if (!range) return range.error();
  if (!range->note.empty()) out.report.push_back({"range_note", range->note, false});
  code_range(*range, *shape, out);
  std::vector<std::array<float, 3>> lights;
  for (const std::size_t pair : subspaces->medoid) {
    const Vector3 v = unit_vector(dataset.info().lights[dataset.info().pairs[pair].light]);
    lights.push_back({static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])});
  }
  std::vector<float> heights;
  for (const std::uint16_t code : out.payload.range)
    heights.push_back(out.payload.height_step * static_cast<float>(code));
  out.payload.relief = take_relief_off(heights, out.range_width, out.range_height, lights, out.channels);
  out.report.push_back({"range_known", fmt::format("{:.4f}", range->known_share)});
  out.report.push_back({"relief", fmt::format("{:.3f}", out.payload.relief)});
  return out;
}

}  // namespace btfc
