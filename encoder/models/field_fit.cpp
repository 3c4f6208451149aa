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

}  // namespace

const std::span<const OptionSpec> kFieldFitOptions = kOptions;

template <ModelId kModel>
Result<FitResult> field_fit(const FitInput& input, const FitSettings& settings) {
  const auto wanted_error = parse_double(settings.options, "error", 1e-6, 1);
  if (!wanted_error) return wanted_error.error();
  const double error = wanted_error->value_or(kDefaultError);
  if (const auto clusters = parse_automatic(settings.options, "clusters", 1, kFieldMostClusters); !clusters)
    return clusters.error();
  constexpr const char* kBands[] = {"power", "laplacian"};
  const auto wanted_bands = parse_choice(settings.options, "bands", kBands);
  if (!wanted_bands) return wanted_bands.error();
  const Bands bands = static_cast<Bands>(wanted_bands->value_or(0));
  const auto order = parse_automatic(settings.options, "order", 0, kFieldCandidates);
  if (!order) return order.error();

  Result<FitResult> result = FitResult{};
  run_on_threads(settings.threads, [&] {
    Result<FieldInput> analysed = field_input(kModel, input, settings);
    if (!analysed) {
      result = analysed.error();
      return;
    }
    Head head = analysed->head;
    head.unbounded = true;
    const auto clusters = static_cast<std::uint32_t>(analysed->channels.size());
    OptionValues options = settings.options;
    options["clusters"] = std::to_string(clusters);
    Result<FieldShape> described = field_shape_from_options(options, head, clusters, 0);
    if (!described) {
      result = described.error();
      return;
    }
    FieldShape& shape = *described;
    shape.clusters = clusters;
    shape.seed = static_cast<std::uint32_t>(settings.seed ^ settings.seed >> 32);
    shape.range_bits = analysed->range_bits;
    shape.range_width = analysed->range_width;
    shape.range_height = analysed->range_height;

    std::vector<SubspaceFactors> subspaces(clusters);
    subspaces[0] = factors_of(analysed->channels[0], shape, analysed->wraps, bands, std::nullopt);
    (void)for_each_index(clusters - 1, [&](std::size_t k) -> Result<Done> {
      subspaces[k + 1] =
          factors_of(analysed->channels[k + 1], shape, analysed->wraps, bands, subspaces[0].basis);
      return Done{};
    });

    FieldPayload payload;
    payload.directions = analysed->directions;
    payload.subspace_of_pair = analysed->subspace_of_pair;
    payload.relief = analysed->relief;
    payload.height_step = analysed->height_step;
    payload.range = analysed->range;
    payload.records = records_of(shape, subspaces);
    shape.masks.clear();
    // The gain of blending and the bump filter may add to an error.
    const double grows = (clusters > 1 ? double{FIELD_MOST_GAIN} : 1) * (1 + double{analysed->relief});
    // Levels and factors share the error; half of it is left to what runs out of a window and back.
    const double share = 0.5 * std::max(0.0, error / grows - kRounding) /
                         (shape.levels * (shape.coupled() ? 1 : shape.factors));
    double reached = kRounding, lost = 0, worst_shrink = 1, worst_radius = 0;
    std::size_t models = 0, unstable = 0, after = 0, shrunk_models = 0;
    for (std::uint32_t l = 0; l < shape.levels; ++l) {
      const LevelFit fit = fit_level(shape, subspaces, l, analysed->wraps, bands, *order, share);
      shape.masks.insert(shape.masks.end(), fit.masks.begin(), fit.masks.end());
      std::uint32_t margin = shape.kind == FieldKind::gmrf ? 0 : 4;
      std::vector<float> numbers;
      for (const std::vector<LevelModel>& of_subspace : fit.models) {
        for (const LevelModel& m : of_subspace) {
          numbers.insert(numbers.end(), m.numbers.begin(), m.numbers.end());
          margin = std::max(margin, m.margin);
          ++models;
          unstable += m.radius >= 1 ? 1 : 0;
          after += m.repaired_radius >= 1 ? 1 : 0;
          shrunk_models += m.shrink < 1 ? 1 : 0;
          lost += m.likelihood_lost;
          worst_shrink = std::min(worst_shrink, m.shrink);
          worst_radius = std::max(worst_radius, m.radius);
        }
      }
      shape.margins[l] = margin;
      payload.levels.push_back(std::move(numbers));
      double level_error = 0;
      for (const std::vector<LevelModel>& of_subspace : fit.models) {
        double sum = 0;
        for (const LevelModel& m : of_subspace) sum += m.tail.empty() ? 0 : m.tail[margin];
        level_error = std::max(level_error, sum);
      }
      reached += 2 * level_error;
      if (settings.progress) settings.progress(l + 1, shape.levels);
    }
    reached *= grows;
    shape.error = static_cast<float>(reached);
    if (const auto valid = read_field_parm(head, write_field_parm(shape)); !valid) {
      Error e = valid.error();
      e.rule = "";
      e.status = Status::bad_argument;
      result = e;
      return;
    }
    if (const auto done = complete_records(head, shape, payload); !done) {
      result = done.error();
      return;
    }
    result->chunks = field_write(head, shape, payload);
    result->meta[fmt::format("{}.seed", find_model(kModel)->name)] = std::to_string(settings.seed);
    result->report = analysed->report;
    const auto number = [&](const char* name, const std::string& value) {
      result->report.push_back({name, value});
    };
    number("clusters", std::to_string(clusters));
    number("error", fmt::format("{:.3g}", reached));
    number("models", std::to_string(models));
    number("unstable", std::to_string(unstable));
    number("unstable_after_repair", std::to_string(after));
    number("shrunk", std::to_string(shrunk_models));
    number("least_shrink", fmt::format("{:.5f}", worst_shrink));
    number("largest_radius", fmt::format("{:.5f}", worst_radius));
    number("likelihood_lost", fmt::format("{:.5g}", lost));
  });
  return result;
}
template Result<FitResult> field_fit<ModelId::car>(const FitInput&, const FitSettings&);
template Result<FitResult> field_fit<ModelId::gmrf>(const FitInput&, const FitSettings&);
template Result<FitResult> field_fit<ModelId::car3d>(const FitInput&, const FitSettings&);

}  // namespace btfc
