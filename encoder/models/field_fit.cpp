// The analysis of Haindl and Filip, section 2, for all three models.
#include "encoder/models/field_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "encoder/fields/band_moments.h"
#include "encoder/fields/colour_factors.h"
#include "encoder/fields/laplacian_pyramid.h"
#include "encoder/fields/level_estimate.h"
#include "encoder/fields/marginal.h"
#include "encoder/fields/neighbourhood_choice.h"
#include "encoder/for_each_index.h"
#include "encoder/linear/row_blocks.h"
#include "encoder/models/field_input.h"
#include "encoder/models/field_records.h"
#include "encoder/run_on_threads.h"
#include "format/models/field_options.h"

namespace btfc {
namespace {

constexpr auto kOptions = [] {
  constexpr OptionSpec kOwn[] = {
      {"bands", "power|laplacian",
       "levels add up by their powers, or are the planes of the Laplacian pyramid as the paper has it "
       "(default power)"},
      {"error", "E", "the most that a texel made alone may differ by, of a range of 1 (default 1/2046)"},
  };
  std::array<OptionSpec, std::size(kFieldOptions) + std::size(kOwn)> all{};
  std::copy(std::begin(kOwn), std::end(kOwn),
            std::copy(std::begin(kFieldOptions), std::end(kFieldOptions), all.begin()));
  return all;
}();

constexpr double kDefaultError = 1.0 / 2046;
// As many as evidence may choose: of a BTF numbers count once a subspace.
constexpr std::uint32_t kMostOfMany = 12, kMostOfOne = 40;
// Of arithmetic in binary32, beside what margins leave.
constexpr double kRounding = 4e-6;

// A subspace's factors as the fields are to model them.
struct SubspaceFactors {
  std::vector<double> mean;
  MatrixD basis;
  std::vector<FieldPlane> planes;                // normal scores, or values where there are no tables
  std::vector<std::vector<float>> tables;        // of the factors
  std::vector<std::vector<FieldPlane>> pyramid;  // of each factor, Gaussian or Laplacian
};

enum class Bands { power, laplacian };

SubspaceFactors factors_of(const std::vector<FieldPlane>& channels, const FieldShape& shape, bool wraps,
                           Bands bands, const std::optional<MatrixD>& like) {
  SubspaceFactors out;
  std::vector<FieldPlane> factors;
  if (shape.coupled()) {
    for (const FieldPlane& c : channels) {
      out.mean.push_back(mean_of(c));
      factors.push_back(c);
      for (double& v : factors.back().values) v -= out.mean.back();
    }
    out.basis = MatrixD::Identity(as_index(channels.size()), as_index(channels.size()));
  } else {
    ColourFactors colours = colour_factors(channels, like);
    out.mean = std::move(colours.mean);
    out.basis = std::move(colours.basis);
    factors = std::move(colours.factors);
  }
  for (FieldPlane& factor : factors) {
    if (shape.knots > 0) {
      out.tables.push_back(marginal_table(factor, shape.knots));
      factor = normal_scores(factor);
    }
    out.pyramid.push_back(bands == Bands::power ? gaussian_pyramid(factor, shape.levels, wraps)
                                                : laplacian_pyramid(factor, shape.levels, wraps));
  }
  out.planes = std::move(factors);
  return out;
}

// How far an error of 1 in a factor moves a channel, at most.
double sensitivity(const SubspaceFactors& s, std::size_t factor) {
  const double slope = s.tables.empty() ? 1 : steepest(s.tables[factor]);
  return slope * s.basis.col(as_index(factor)).cwiseAbs().maxCoeff();
}

// The chosen neighbourhoods and settled models of a level.
struct LevelFit {
  std::vector<std::uint64_t> masks;             // by factor, of car3d one
  std::vector<std::vector<LevelModel>> models;  // by subspace, then factor (car3d: one)
};

LevelFit fit_level(const FieldShape& shape, const std::vector<SubspaceFactors>& subspaces,
                   std::uint32_t level, bool wraps, Bands bands, std::optional<std::uint32_t> order,
                   double error) {
  const std::uint32_t most = subspaces.size() > 1 ? kMostOfMany : kMostOfOne;
  const std::size_t d = shape.factors, groups = shape.masks_per_level();
  const auto kind = shape.kind == FieldKind::gmrf ? Neighbourhood::symmetric : Neighbourhood::causal;
  LevelFit fit;
  fit.models.resize(subspaces.size(), std::vector<LevelModel>(groups));
  for (std::size_t f = 0; f < groups; ++f) {
    std::vector<NeighbourMoments> moments(subspaces.size());
    const auto planes_of_level = [&](std::size_t k, std::uint32_t l) {
      std::vector<FieldPlane> planes;
      for (std::size_t g = shape.coupled() ? 0 : f; g < (shape.coupled() ? d : f + 1); ++g)
        planes.push_back(subspaces[k].pyramid[g][l]);
      return planes;
    };
    (void)for_each_index(subspaces.size(), [&](std::size_t k) -> Result<Done> {
      const bool overlaps = bands == Bands::power && level + 1 < shape.levels;
      const auto coarse = overlaps ? planes_of_level(k, level + 1) : std::vector<FieldPlane>();
      moments[k] = band_moments(planes_of_level(k, level), coarse, kind, wraps);
      return Done{};
    });
    fit.masks.push_back(choose_neighbourhood(moments, order, most));
    (void)for_each_index(subspaces.size(), [&](std::size_t k) -> Result<Done> {
      LevelDemand demand;
      demand.precision = shape.precision;
      demand.level = level;
      demand.error = error;
      for (std::size_t g = 0; g < moments[k].planes; ++g) {
        demand.variance.push_back(std::max(0.0, moments[k].moments(moments[k].own(g), moments[k].own(g))));
        demand.weight.push_back(sensitivity(subspaces[k], shape.coupled() ? g : f));
      }
      fit.models[k][f] = shape.kind == FieldKind::gmrf
                             ? settle_markov(moments[k], fit.masks[f], shape.torus_side(level), demand)
                             : settle_recursion(moments[k], fit.masks[f], demand);
      return Done{};
    });
  }
  return fit;
}

// Means, bases and tables, all else 0.
std::vector<float> records_of(const FieldShape& shape, const std::vector<SubspaceFactors>& subspaces) {
  std::vector<float> records;
  for (const SubspaceFactors& s : subspaces) {
    for (const double m : s.mean) records.push_back(static_cast<float>(m));
    for (std::uint32_t c = 0; c < shape.factors && !shape.coupled(); ++c) {
      for (std::uint32_t f = 0; f < shape.factors; ++f)
        records.push_back(static_cast<float>(s.basis(as_index(c), as_index(f))));
    }
    records.insert(records.end(), 4, 0.0f);
    for (std::uint32_t f = 0; f < shape.factors; ++f) {
      records.push_back(1.0f);
      records.insert(records.end(), shape.levels - 1, 0.0f);
      if (shape.knots > 0) records.insert(records.end(), s.tables[f].begin(), s.tables[f].end());
    }
  }
  return records;
}

Result<LoadedItem> load_chunks(const Head& head, const FieldShape& shape, const FieldPayload& payload) {
  const std::vector<RawChunk> chunks = field_write(head, shape, payload);
  const ChunkReader read = [&](const ChunkKey& key) -> Result<Bytes> {
    const auto found = std::find_if(chunks.begin(), chunks.end(), [&](const RawChunk& c) {
      return c.key.type == key.type && c.key.level == key.level;
    });
    return found->raw;
  };
  return field_load(head, write_field_parm(shape), read, kAllLevels);
}

FieldParams params_of_item(const LoadedItem& item) {
  FieldParams p;
  std::memcpy(&p, item.map_params[0].data(), sizeof p);
  return p;
}

// Scales, rests and signatures, from the fields that the chunks make.
Result<Done> complete_records(const Head& head, const FieldShape& shape, FieldPayload& payload) {
  Result<LoadedItem> item = load_chunks(head, shape, payload);
  if (!item) return item.error();
  const FieldParams p = params_of_item(*item);
  const std::size_t record = shape.record_numbers();
  const std::size_t first = record - shape.factors * (shape.levels + shape.knots);
  (void)for_each_index(shape.clusters, [&](std::size_t k) -> Result<Done> {
    for (std::uint32_t f = 0; f < shape.factors; ++f) {
      const std::vector<double> v = factor_variances(*item, p, static_cast<std::uint32_t>(k), f);
      float* to = &payload.records[k * record + first + f * (shape.levels + shape.knots)];
      to[0] = v[0] > 0 && shape.knots > 0 ? static_cast<float>(1 / std::sqrt(v[0])) : 1;
      for (std::uint32_t l = 1; l < shape.levels; ++l)
        to[l] = v[0] > 0 ? static_cast<float>(std::sqrt(std::max(0.0, 1 - v[l] / v[0]))) : 0;
    }
    return Done{};
  });
  item = load_chunks(head, shape, payload);
  if (!item) return item.error();
  const auto signatures = subspace_signatures(*item, p);
  for (std::size_t k = 0; k < signatures.size(); ++k)
    std::copy(signatures[k].begin(), signatures[k].end(), &payload.records[k * record + first - 4]);
  return Done{};
}

// What the options ask of a fit, beside the shape.
struct Wanted {
  double error = kDefaultError;
  Bands bands = Bands::power;
  std::optional<std::uint32_t> order;
};

Result<Wanted> wanted_of(const OptionValues& options) {
  Wanted wanted;
  const auto error = parse_double(options, "error", 1e-6, 1);
  if (!error) return error.error();
  wanted.error = error->value_or(kDefaultError);
  constexpr const char* kBands[] = {"power", "laplacian"};
  const auto bands = parse_choice(options, "bands", kBands);
  if (!bands) return bands.error();
  wanted.bands = static_cast<Bands>(bands->value_or(0));
  const auto order = parse_automatic(options, "order", 0, kFieldCandidates);
  if (!order) return order.error();
  wanted.order = *order;
  if (const auto clusters = parse_automatic(options, "clusters", 1, kFieldMostClusters); !clusters)
    return clusters.error();
  return wanted;
}

// PARM but for neighbourhoods, margins and the error.
Result<FieldShape> shape_of(const FieldInput& input, const FitSettings& settings) {
  const auto clusters = static_cast<std::uint32_t>(input.channels.size());
  OptionValues options = settings.options;
  options["clusters"] = std::to_string(clusters);
  Result<FieldShape> shape = field_shape_from_options(options, input.head, clusters, 0);
  if (!shape) return shape.error();
  shape->clusters = clusters;
  shape->seed = static_cast<std::uint32_t>(settings.seed ^ settings.seed >> 32);
  shape->range_bits = input.range_bits;
  shape->range_width = input.range_width;
  shape->range_height = input.range_height;
  shape->masks.clear();
  return shape;
}

std::vector<SubspaceFactors> all_factors(const FieldInput& input, const FieldShape& shape, Bands bands) {
  std::vector<SubspaceFactors> subspaces(input.channels.size());
  subspaces[0] = factors_of(input.channels[0], shape, input.wraps, bands, std::nullopt);
  (void)for_each_index(subspaces.size() - 1, [&](std::size_t k) -> Result<Done> {
    subspaces[k + 1] = factors_of(input.channels[k + 1], shape, input.wraps, bands, subspaces[0].basis);
    return Done{};
  });
  return subspaces;
}

// What became of all levels' models.
struct Stability {
  std::size_t models = 0, unstable = 0, after = 0, shrunk = 0;
  double least_shrink = 1, largest_radius = 0, likelihood_lost = 0;

  void add(const LevelModel& m) {
    ++models;
    unstable += m.radius >= 1 ? 1 : 0;
    after += m.repaired_radius >= 1 ? 1 : 0;
    shrunk += m.shrink < 1 ? 1 : 0;
    least_shrink = std::min(least_shrink, m.shrink);
    largest_radius = std::max(largest_radius, m.radius);
    likelihood_lost += m.likelihood_lost;
  }
  std::vector<Parameter> report() const {
    return {{"models", std::to_string(models)},
            {"unstable", std::to_string(unstable)},
            {"unstable_after_repair", std::to_string(after)},
            {"shrunk", std::to_string(shrunk)},
            {"least_shrink", fmt::format("{:.5f}", least_shrink)},
            {"largest_radius", fmt::format("{:.5f}", largest_radius)},
            {"likelihood_lost", fmt::format("{:.5g}", likelihood_lost)}};
  }
};

// Fits level after level: completes the shape and the payload's levels.
Stability settle_levels(const FieldInput& input, const std::vector<SubspaceFactors>& subspaces,
                        const Wanted& wanted, const FitSettings& settings, FieldShape& shape,
                        FieldPayload& payload) {
  // The gain of blending and the bump filter may add to an error.
  const double grows = (shape.clusters > 1 ? double{FIELD_MOST_GAIN} : 1) * (1 + double{payload.relief});
  // Levels and factors share the error; half of it is left to what runs out of a window and back.
  const double share = 0.5 * std::max(0.0, wanted.error / grows - kRounding) /
                       (shape.levels * (shape.coupled() ? 1 : shape.factors));
  Stability stability;
  double reached = kRounding;
  for (std::uint32_t l = 0; l < shape.levels; ++l) {
    const LevelFit fit = fit_level(shape, subspaces, l, input.wraps, wanted.bands, wanted.order, share);
    shape.masks.insert(shape.masks.end(), fit.masks.begin(), fit.masks.end());
    std::uint32_t margin = shape.kind == FieldKind::gmrf ? 0 : 4;
    payload.levels.emplace_back();
    for (const std::vector<LevelModel>& of_subspace : fit.models) {
      for (const LevelModel& m : of_subspace) {
        payload.levels.back().insert(payload.levels.back().end(), m.numbers.begin(), m.numbers.end());
        margin = std::max(margin, m.margin);
        stability.add(m);
      }
    }
    shape.margins[l] = margin;
    double level_error = 0;
    for (const std::vector<LevelModel>& of_subspace : fit.models) {
      double sum = 0;
      for (const LevelModel& m : of_subspace) sum += m.tail.empty() ? 0 : m.tail[margin];
      level_error = std::max(level_error, sum);
    }
    reached += 2 * level_error;
    if (settings.progress) settings.progress(l + 1, shape.levels);
  }
  shape.error = static_cast<float>(grows * reached);
  return stability;
}

Result<FitResult> fit(ModelId model, const FitInput& input, const Wanted& wanted,
                      const FitSettings& settings) {
  Result<FieldInput> analysed = field_input(model, input, settings);
  if (!analysed) return analysed.error();
  analysed->head.unbounded = true;
  const Head& head = analysed->head;
  Result<FieldShape> shape = shape_of(*analysed, settings);
  if (!shape) return shape.error();
  const std::vector<SubspaceFactors> subspaces = all_factors(*analysed, *shape, wanted.bands);
  FieldPayload payload = std::move(analysed->payload);
  payload.records = records_of(*shape, subspaces);
  const Stability stability = settle_levels(*analysed, subspaces, wanted, settings, *shape, payload);
  if (const auto valid = read_field_parm(head, write_field_parm(*shape)); !valid) {
    Error error = valid.error();
    error.rule = "";
    error.status = Status::bad_argument;
    return error;
  }
  if (const auto done = complete_records(head, *shape, payload); !done) return done.error();
  FitResult result;
  result.chunks = field_write(head, *shape, payload);
  result.meta[fmt::format("{}.seed", find_model(model)->name)] = std::to_string(settings.seed);
  result.report = analysed->report;
  result.report.push_back({"clusters", std::to_string(shape->clusters)});
  result.report.push_back({"error", fmt::format("{:.3g}", shape->error)});
  for (Parameter& found : stability.report()) result.report.push_back(std::move(found));
  return result;
}

}  // namespace

const std::span<const OptionSpec> kFieldFitOptions = kOptions;

template <ModelId kModel>
Result<FitResult> field_fit(const FitInput& input, const FitSettings& settings) {
  use_blas_single_threaded();  // its eigenvalues must not depend on the machine's cores
  const Result<Wanted> wanted = wanted_of(settings.options);
  if (!wanted) return wanted.error();
  Result<FitResult> result = FitResult{};
  run_on_threads(settings.threads, [&] { result = fit(kModel, input, *wanted, settings); });
  return result;
}
template Result<FitResult> field_fit<ModelId::car>(const FitInput&, const FitSettings&);
template Result<FitResult> field_fit<ModelId::gmrf>(const FitInput&, const FitSettings&);
template Result<FitResult> field_fit<ModelId::car3d>(const FitInput&, const FitSettings&);

}  // namespace btfc
