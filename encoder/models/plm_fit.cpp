// Data set -> lobes or codebooks of them, polynomials -> chunks.
#include "encoder/models/plm_fit.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "encoder/dataset/dataset_head.h"
#include "encoder/dataset/view_pairs.h"
#include "encoder/for_each_index.h"
#include "encoder/linear/dataset_rows.h"
#include "encoder/models/plm_clusters.h"
#include "encoder/models/plm_lobes.h"
#include "encoder/models/plm_polynomials.h"
#include "encoder/run_on_threads.h"
#include "format/models/plm_payload.h"

namespace btfc {
namespace {

const OptionSpec kOptions[] = {
    {"precision", "f32|f16|u8", "of the lobes (default f32)"},
    {"table-precision", "f32|f16|u8", "of the polynomials (default f32)"},
    {"polynomial", "none|histogram|least-squares",
     "how eq. 4 is fitted; histogram is the survey's way (default least-squares)"},
    {"clusters", "C", "lobes of a view and channel, 1 to 256 (default 0: one a texel)"},
    {"iterations", "T",
     "steps of Levenberg and Marquardt's method, the survey has 2 (default: to convergence)"},
};

struct Settings {
  PlmShape shape;
  PlmPolynomial polynomial = PlmPolynomial::least_squares;
  unsigned steps = 0;
};

Result<Settings> settings_of(const OptionValues& options) {
  Settings s;
  const Result<PlmShape> shape = plm_shape_from_options(options);
  if (!shape) return shape.error();
  const auto polynomial = parse_choice(options, "polynomial", kPlmPolynomialNames);
  if (!polynomial) return polynomial.error();
  const auto steps = parse_u32(options, "iterations", 1, 10000);
  if (!steps) return steps.error();
  if (*polynomial) s.polynomial = static_cast<PlmPolynomial>(**polynomial);
  s.shape = *shape;
  s.steps = steps->value_or(0);
  return s;
}

using Progress = std::function<void(std::size_t, std::size_t)>;

// A lobe a texel, by blocks of texels: [view][(m channels + c) texels + t].
std::vector<LobePlanes> fit_lobes(const Dataset& dataset, const std::vector<ViewPairs>& pairs,
                                  const std::vector<LobeLights>& lights, unsigned steps,
                                  const Progress& progress) {
  const std::size_t channels = dataset.info().channels.size();
  const RowBlocks rows = image_rows(dataset, false);
  const std::size_t texels = rows.rows / channels;
  std::vector<LobePlanes> views(pairs.size(), LobePlanes(kLobeParameters * rows.rows));
  const auto fit_batch = [&](const Matrix& block, std::size_t block_row, std::size_t first, std::size_t v) {
    const auto used = std::min(kLobeLanes, static_cast<std::size_t>(block.rows()) - first);
    const std::size_t count = pairs[v].count;
    std::vector<float> values(count * kLobeLanes);
    for (std::size_t l = 0; l < kLobeLanes; ++l) {
      // Lanes that are not needed repeat the last one.
      const float* row = &block(as_index(first + std::min(l, used - 1)), as_index(pairs[v].first));
      for (std::size_t i = 0; i < count; ++i) values[i * kLobeLanes + l] = row[i];
    }
    LobeBatch batch;
    start_lobes(lights[v], values.data(), batch);
    refine_lobes(lights[v], values.data(), steps, batch);
    for (std::size_t l = 0; l < used; ++l) {
      const std::size_t row = block_row + first + l, texel = row / channels, channel = row % channels;
      for (std::size_t m = 0; m < kLobeParameters; ++m)
        views[v][(m * channels + channel) * texels + texel] = batch.parameter[m][l];
    }
  };
  std::size_t done = 0;
  for_each_block(
      rows,
      [&](const Matrix& block, std::size_t number, std::size_t) {
        const auto batches = ceil_div(static_cast<std::uint64_t>(block.rows()), kLobeLanes);
        tbb::parallel_for(std::size_t{0}, batches * pairs.size(), [&](std::size_t i) {
          fit_batch(block, number * rows.block_rows, i / pairs.size() * kLobeLanes, i % pairs.size());
        });
      },
      [&](std::size_t) {
        if (progress) progress(++done, rows.count());
      });
  return views;
}

// One view's values of one channel: a row a texel, a column a light.
std::vector<Matrix> view_values(const Dataset& dataset, const ViewPairs& pairs,
                                const std::vector<float>& table) {
  const DatasetInfo& info = dataset.info();
  const std::size_t channels = info.channels.size(), texels = std::size_t{info.width} * info.height;
  std::vector<Matrix> values(channels, Matrix(as_index(texels), as_index(pairs.count)));
  std::vector<std::uint16_t> codes(info.image_samples());
  for (std::size_t i = 0; i < pairs.count; ++i) {
    dataset.read_image(pairs.first + i, codes);
    for (std::size_t t = 0; t < texels; ++t) {
      for (std::size_t c = 0; c < channels; ++c)
        values[c](as_index(t), as_index(i)) = table[codes[t * channels + c]];
    }
  }
  return values;
}

std::vector<float> values_of(const CodedRows& rows) {
  std::vector<float> values(rows.elements.size());
  for (std::uint64_t r = 0; r < rows.rows; ++r) {
    for (std::uint64_t c = 0; c < rows.columns; ++c) values[r * rows.columns + c] = rows.value(r, c);
  }
  return values;
}

// Codebooks of all views, coded, and the entries of their texels, chosen with the coded lobes.
void fit_books(const Dataset& dataset, const std::vector<ViewPairs>& pairs,
               const std::vector<LobeLights>& lights, const Settings& s, const Progress& progress,
               PlmPayload& payload) {
  const std::size_t channels = dataset.info().channels.size(), entries = s.shape.clusters;
  const std::vector<float> table = value_table(dataset.info().type);
  payload.lobes.resize(pairs.size());
  payload.entries.resize(pairs.size());
  use_blas_single_threaded();
  const auto fit_view = [&](std::size_t v) {
    const std::vector<Matrix> values = view_values(dataset, pairs[v], table);
    std::vector<float> rows(kLobeParameters * channels * entries);
    for (std::size_t c = 0; c < channels; ++c) {
      const LobeBook book = fit_book(lights[v], values[c], entries, s.steps);
      for (std::size_t m = 0; m < kLobeParameters; ++m)
        std::copy_n(&book.parameters[m * entries], entries, &rows[(m * channels + c) * entries]);
    }
    payload.lobes[v] = code_rows(rows, kLobeParameters * channels, entries, s.shape.lobes);
    rows = values_of(payload.lobes[v]);
    for (std::size_t c = 0; c < channels; ++c) {
      LobeBook coded{entries, std::vector<float>(kLobeParameters * entries)};
      for (std::size_t m = 0; m < kLobeParameters; ++m)
        std::copy_n(&rows[(m * channels + c) * entries], entries, &coded.parameters[m * entries]);
      const std::vector<std::uint8_t> nearest = nearest_entries(lights[v], values[c], coded);
      payload.entries[v].insert(payload.entries[v].end(), nearest.begin(), nearest.end());
    }
    return Result<Done>(Done{});
  };
  static_cast<void>(for_each_index(pairs.size(), fit_view, progress));
}

// The lobes of a view's texels as decoders read them.
LobePlanes decoded_lobes(const PlmPayload& payload, const PlmShape& shape, std::size_t view,
                         std::size_t channels, std::size_t texels) {
  const CodedRows& rows = payload.lobes[view];
  if (shape.clusters == 0) return values_of(rows);
  LobePlanes planes(kLobeParameters * channels * texels);
  for (std::size_t r = 0; r < kLobeParameters * channels; ++r) {
    for (std::size_t t = 0; t < texels; ++t)
      planes[r * texels + t] = rows.value(r, payload.entries[view][r % channels * texels + t]);
  }
  return planes;
}

}  // namespace

const std::span<const OptionSpec> kPlmFitOptions = kOptions;

Result<FitResult> plm_fit(const FitInput& input, const FitSettings& settings) {
  Result<Settings> parsed = settings_of(settings.options);
  if (!parsed) return parsed.error();
  Settings& s = *parsed;
  const Dataset& dataset = *input.dataset;
  const Result<DatasetHead> described = dataset_head(dataset.info(), ModelId::plm);
  if (!described) return described.error();
  const std::size_t channels = dataset.info().channels.size(), pairs = dataset.info().pairs.size();
  const std::size_t texels = std::size_t{dataset.info().width} * dataset.info().height;
  s.shape.clusters = static_cast<std::uint32_t>(std::min<std::size_t>(s.shape.clusters, texels));
  if (const auto fits = read_plm_parm(described->head, write_plm_parm(s.shape)); !fits) return fits.error();

  const std::vector<ViewPairs> views = pairs_of_views(dataset.info());
  std::vector<LobeLights> lights;
  for (const ViewPairs& view : views)
    lights.push_back(lobe_lights(lights_of(described->directions, view), weights_of(dataset.info(), view)));
  PlmPayload payload;
  payload.directions = described->directions;
  PlmPolynomials polynomials;
  run_on_threads(settings.threads, [&] {
    if (s.shape.clusters > 0) {
      fit_books(dataset, views, lights, s, settings.progress, payload);
    } else {
      std::vector<LobePlanes> lobes = fit_lobes(dataset, views, lights, s.steps, settings.progress);
      for (LobePlanes& planes : lobes) {
        payload.lobes.push_back(code_rows(planes, kLobeParameters * channels, texels, s.shape.lobes));
        LobePlanes().swap(planes);  // large sets: not twice in memory
      }
    }
    // The polynomials see the lobes as they are coded.
    std::vector<LobePlanes> coded;
    for (std::size_t v = 0; v < views.size(); ++v)
      coded.push_back(decoded_lobes(payload, s.shape, v, channels, texels));
    polynomials = fit_polynomials(dataset, described->directions, coded, s.polynomial, settings.progress);
  });
  if (s.shape.polynomials)
    payload.terms = code_rows(polynomials.terms, kPlmTerms * channels, pairs, s.shape.terms);

  FitResult result;
  result.chunks = plm_write(described->head, s.shape, payload);
  const double samples = static_cast<double>(texels * channels) * static_cast<double>(pairs);
  result.report = {{"clusters", std::to_string(s.shape.clusters)},
                   {"lobe_rmse", fmt::format("{:.6g}", std::sqrt(polynomials.lobe_squares / samples))},
                   {"fit_rmse", fmt::format("{:.6g}", std::sqrt(polynomials.squares / samples))},
                   {"polynomials_kept", std::to_string(polynomials.kept)}};
  return result;
}

}  // namespace btfc
