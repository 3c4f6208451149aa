// btfc_bench_fields FILE.btfc [--quick]: files of model car, gmrf or car3d: single texels against one big
// window, seams of tiles, the trade of margins, and speeds beside a plain loop, all in one run.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>

#include "btfc/btfc.h"
#include "encoder/run_on_threads.h"
#include "encoder/split_mix.h"
#include "format/container.h"
#include "format/models/field_collapse.h"
#include "tools/file_source.h"
#include "tools/texture_file.h"

using namespace btfc;

namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Loaded {
  LoadedItem item;
  FieldParams p;
  float error;  // as the file states it
};

Result<Loaded> load(const char* path) {
  const Result<FileSource> file = FileSource::open(path);
  if (!file) return file.error();
  const ByteSource source = file->source();
  const Result<OpenedFile> opened = open_file(source);
  if (!opened) return opened.error();
  Result<LoadedItem> item = load_item(source, *opened, kAllLevels);
  if (!item) return item.error();
  Loaded out{*std::move(item), {}, 0};
  if (out.item.map_params[0].size() * 4 != sizeof(FieldParams))
    return bad_data("not a file of a random field");
  std::memcpy(&out.p, out.item.map_params[0].data(), sizeof out.p);
  const Result<FieldShape> shape = read_field_parm(opened->head, opened->parm);
  if (!shape) return shape.error();
  out.error = shape->error;
  return out;
}

BtfcWords words_of(const LoadedItem& item) {
  return {{item.words[0].data(), item.words[1].data(), nullptr, nullptr}};
}

// Deviations of all channels, interleaved.
std::vector<float> window_values(const Loaded& l, std::uint32_t subspace, const FieldWindow& window) {
  const std::uint32_t subspaces[] = {subspace};
  const std::vector<float> factors = field_collapse(l.item, l.p, 0, 0, subspaces, window);
  std::vector<float> out(window.texels() * l.p.all_channels);
  field_deviations(words_of(l.item), l.p, subspace, 0, factors.data(), window.texels(), window.texels(),
                   out.data());
  return out;
}

double worst_difference(const std::vector<float>& a, const std::vector<float>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::fabs(double{a[i]} - double{b[i]}));
  return worst;
}

// A directions pair of one subspace alone: the first measured pair that the file gives to it.
btfc_directions directions_of(const btfc_texture* texture, std::uint32_t pair) {
  btfc_directions d{};
  std::uint32_t view = 0, light = 0;
  btfc_texture_pair(texture, pair, &view, &light);
  btfc_texture_view(texture, view, d.view);
  btfc_texture_light(texture, light, d.light);
  d.footprint = 1;
  return d;
}

// Texels alone, through a cache and by the direct form, against one window of side x side.
void single_texels(const Loaded& l, const btfc_texture* texture, std::uint32_t side, std::uint32_t cached,
                   std::uint32_t direct) {
  std::vector<float> big;
  const btfc_directions directions = directions_of(texture, 0);
  const BtfcWords words = words_of(l.item);
  const FieldBlend blend =
      field_blend(words, l.p, vec3(directions.view[0], directions.view[1], directions.view[2]),
                  vec3(directions.light[0], directions.light[1], directions.light[2]));
  const std::uint32_t subspace = blend.subspace[0];
  const double begin = now();
  big = window_values(l, subspace, {0, 0, side, side});
  const double synthesis = now() - begin;
  const std::size_t texels = std::size_t{side} * side;
  const vec4 mean = field_mean(words, l.p, subspace);
  SplitMix64 random(7);
  const std::unique_ptr<btfc_scratch, decltype(&btfc_scratch_free)> scratch(btfc_scratch_new(texture),
                                                                            btfc_scratch_free);
  const auto compare = [&](std::uint32_t count, btfc_scratch* with, double& seconds) {
    double worst = 0;
    const double start = now();
    for (std::uint32_t i = 0; i < count; ++i) {
      btfc_query q{};
      q.x = static_cast<std::int32_t>(random.below(side));
      q.y = static_cast<std::int32_t>(random.below(side));
      std::copy_n(directions.view, 3, q.view);
      std::copy_n(directions.light, 3, q.light);
      q.footprint = 1;
      float value[4];
      btfc_eval(texture, with, &q, sizeof q, 1, value, 4);
      for (std::uint32_t c = 0; c < l.p.channels; ++c) {
        const double expected =
            double{mean[static_cast<int>(c)]} +
            double{
                big[(std::size_t{static_cast<std::uint32_t>(q.y)} * side + static_cast<std::uint32_t>(q.x)) *
                        l.p.all_channels +
                    c]};
        worst = std::max(worst, std::fabs(double{value[c]} - expected));
      }
    }
    seconds = now() - start;
    return worst;
  };
  double cached_seconds = 0, direct_seconds = 0;
  const double by_tiles = compare(cached, scratch.get(), cached_seconds);
  const double by_sums = compare(direct, nullptr, direct_seconds);
  fmt::print(
      "window {0}x{0} of subspace {1}: {2:.2f} s, {3:.2f} Mtexel/s\n"
      "{4} texels alone (tiles): worst {5:.3e}; {6} by the direct form: worst {7:.3e} ({8:.0f} texel/s); "
      "stored error {9:.3e}\n",
      side, subspace, synthesis, static_cast<double>(texels) / synthesis / 1e6, cached, by_tiles, direct,
      by_sums, direct / direct_seconds, double{l.error});
}

// Both tiles' values of the texels beside a seam.
void seams(const Loaded& l, std::uint32_t count) {
  SplitMix64 random(11);
  double worst = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t subspace = i % l.p.clusters;
    const auto tile = [&] { return 256 * (static_cast<std::int64_t>(random.below(1u << 16)) - 32768); };
    const std::int64_t x = tile(), y = tile();
    constexpr std::uint32_t kRows = 8;
    // The columns at x - 1 and x, of a tile that ends there and of one that begins.
    const FieldWindow left{x - 255, y, 256 + 1, kRows}, right{x - 1, y, 256 + 1, kRows};
    const std::vector<float> a = window_values(l, subspace, left), b = window_values(l, subspace, right);
    for (std::uint32_t c = 0; c < l.p.all_channels; ++c) {
      for (std::uint32_t r = 0; r < kRows; ++r) {
        for (std::uint32_t o = 0; o < 2; ++o) {
          const double d = double{a[(std::size_t{r} * left.width + 254 + o) * l.p.all_channels + c]} -
                           double{b[(std::size_t{r} * right.width + o) * l.p.all_channels + c]};
          worst = std::max(worst, std::fabs(d));
        }
      }
    }
  }
  fmt::print("{} seams: worst difference {:.3e} = {:.3f} / 1023\n", count, worst, worst * 1023);
}

// Every level's margin at most `margin`.
Loaded with_margin(Loaded l, std::uint32_t margin) {
  for (std::uint32_t level = 0; level < l.p.levels; ++level) {
    std::uint32_t& own = l.item.words[0][l.p.level_word + FIELD_LEVEL_WORDS * level];
    own = margin > 255 ? margin : std::min(own, margin);
  }
  return l;
}

void margins(const Loaded& l) {
  const FieldWindow tile{512, 512, 256, 256};
  const std::vector<float> truth = window_values(with_margin(l, 400), 0, tile);
  fmt::print("margin  worst error  rms error  cost of a tile\n");
  double whole = 0;
  for (const std::uint32_t margin : {255u, 127u, 96u, 64u, 48u, 32u, 24u, 16u, 8u}) {
    const Loaded own = with_margin(l, margin);
    const double begin = now();
    const std::vector<float> values = window_values(own, 0, tile);
    const double seconds = now() - begin;
    if (whole == 0) whole = seconds;
    double square = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double d = double{values[i]} - double{truth[i]};
      square += d * d;
    }
    fmt::print("{:>6}  {:.3e}    {:.3e}  {:.2f}\n", margin == 255 ? "file's" : std::to_string(margin),
               worst_difference(values, truth), std::sqrt(square / static_cast<double>(values.size())),
               seconds / whole);
  }
}

// Binary32 against binary64, all levels' bands.
void precision(const Loaded& l) {
  double worst = 0;
  for (std::uint32_t level = 0; level < l.p.levels; ++level) {
    const FieldBand band = field_band_of_words(l.item, l.p, level);
    const FieldWindow window{1000, -1000, 64, 64};
    std::vector<float> single(window.texels() * l.p.all_channels);
    std::vector<double> twice(single.size());
    field_synthesise_plain(band, 0, window, single.data());
    field_synthesise_plain(band, 0, window, twice.data());
    for (std::size_t i = 0; i < single.size(); ++i)
      worst = std::max(worst, std::fabs(double{single[i]} - twice[i]));
  }
  fmt::print("binary32 against binary64, in scores: worst {:.3e}\n", worst);
}

// fine += expand(coarse), texel by texel.
void expand_plain(const std::vector<double>& coarse, const FieldWindow& cw, const FieldWindow& fw,
                  std::size_t planes, std::vector<double>& fine) {
  for (std::size_t p = 0; p < planes; ++p) {
    for (std::uint32_t y = 0; y < fw.height; ++y) {
      for (std::uint32_t x = 0; x < fw.width; ++x) {
        const std::int64_t u = fw.x + x, v = fw.y + y;
        const auto weight = [](std::int64_t at, int i) {
          return (at & 1) != 0 ? (i < 0 ? 0.0 : 0.5) : (i == 0 ? 0.75 : 0.125);
        };
        double sum = 0;
        for (int j = -1; j <= 1; ++j) {
          for (int i = -1; i <= 1; ++i) {
            const auto at = static_cast<std::size_t>(((v >> 1) + j - cw.y) * cw.width + (u >> 1) + i - cw.x);
            sum += weight(u, i) * weight(v, j) * coarse[p * cw.texels() + at];
          }
        }
        fine[p * fw.texels() + std::size_t{y} * fw.width + x] += sum;
      }
    }
  }
}

std::vector<double> collapse_plain(const Loaded& l, std::uint32_t level, std::uint32_t subspace,
                                   const FieldWindow& window) {
  std::vector<double> values(window.texels() * l.p.all_channels);
  field_synthesise_plain(field_band_of_words(l.item, l.p, level), subspace, window, values.data());
  if (level + 1 == l.p.levels) return values;
  const FieldWindow wider = field_coarse_window(window);
  expand_plain(collapse_plain(l, level + 1, subspace, wider), wider, window, l.p.all_channels, values);
  return values;
}

// A window of all subspaces, levels collapsed: a plain double loop on one thread, and vectors on one and two.
void all_subspaces(const Loaded& l, std::uint32_t side) {
  // Threads share the subspaces, or the rows of a single one.
  const auto fast = [&](unsigned threads) {
    const double begin = now();
    run_on_threads(threads, [&] {
      tbb::parallel_for(0u, threads, [&](unsigned part) {
        std::vector<std::uint32_t> subspaces;
        const bool rows = l.p.clusters < threads;
        for (std::uint32_t k = 0; k < l.p.clusters; ++k) {
          if (rows || k % threads == part) subspaces.push_back(k);
        }
        const std::uint32_t height = rows ? side / threads : side;
        const auto values = field_collapse(l.item, l.p, 0, 0, subspaces,
                                           {0, rows ? std::int64_t{part} * height : 0, side, height});
        if (values.empty()) std::abort();
      });
    });
    return now() - begin;
  };
  const auto best = [](const auto& call) {
    double least = call();
    for (int i = 0; i < 4; ++i) least = std::min(least, call());
    return least;
  };
  const double one = best([&] { return fast(1); }), two = best([&] { return fast(2); });
  const double plain = best([&] {
    const double begin = now();
    for (std::uint32_t k = 0; k < l.p.clusters; ++k) {
      if (collapse_plain(l, 0, k, {0, 0, side, side}).empty()) std::abort();
    }
    return now() - begin;
  });
  const double texels = double{static_cast<double>(side)} * side * l.p.clusters;
  fmt::print(
      "{0}x{0} of {1} subspaces: plain {2:.3f} s, 1 thread {3:.4f} s (ratio {4:.1f}), 2 threads {5:.4f} s "
      "(ratio {6:.1f}, {7:.1f} Mtexel/s)\n",
      side, l.p.clusters, plain, one, plain / one, two, plain / two, texels / two / 1e6);
}

void random_texels(const btfc_texture* texture, std::size_t count, bool all_directions) {
  const std::unique_ptr<btfc_scratch, decltype(&btfc_scratch_free)> scratch(btfc_scratch_new(texture),
                                                                            btfc_scratch_free);
  SplitMix64 random(3);
  std::vector<btfc_query> queries(count);
  const std::uint32_t pairs = btfc_texture_pairs(texture);
  btfc_directions d = directions_of(texture, 0);
  for (btfc_query& q : queries) {
    if (all_directions) d = directions_of(texture, random.below(pairs));
    q = {};
    q.x = static_cast<std::int32_t>(random.below(1024));
    q.y = static_cast<std::int32_t>(random.below(1024));
    for (std::size_t i = 0; i < 3; ++i) {
      // Between the measured directions, so that several subspaces count.
      q.view[i] = d.view[i] + (i < 2 ? 0.05f : 0.0f);
      q.light[i] = d.light[i] + (i < 2 ? 0.05f : 0.0f);
    }
    q.footprint = 1;
  }
  std::vector<float> values(4 * count);
  const double begin = now();
  btfc_eval(texture, scratch.get(), queries.data(), sizeof(btfc_query), count, values.data(), 4);
  const double seconds = now() - begin;
  fmt::print("{:.0e} random texels of 1024x1024, {}: {:.2f} Mtexel/s a thread, cold cache counted\n",
             static_cast<double>(count), all_directions ? "random directions" : "one pair of directions",
             static_cast<double>(count) / seconds / 1e6);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "btfc_bench_fields FILE.btfc [--quick]\n");
    return 1;
  }
  const bool quick = argc > 2;
  const Result<Loaded> loaded = load(argv[1]);
  if (!loaded) {
    fmt::print(stderr, "btfc_bench_fields: {}\n", loaded.error().message);
    return 1;
  }
  const Result<TexturePtr> texture = load_texture(argv[1], nullptr);
  // The window knows no bump filter.
  btfc_selection level_ground{};
  level_ground.struct_size = sizeof level_ground;
  level_ground.relief = BTFC_RELIEF_NONE;
  const Result<TexturePtr> flat = load_texture(argv[1], &level_ground);
  if (!texture || !flat) return 1;
  if (argc < 4) single_texels(*loaded, flat->get(), quick ? 1024 : 4096, 10000, quick ? 20 : 100);
  if (argc < 4) seams(*loaded, quick ? 100 : 1000);
  if (loaded->p.kind != FIELD_GMRF) {
    if (argc < 4) margins(*loaded);
    if (argc < 4) precision(*loaded);
    all_subspaces(*loaded, 512);
  }
  random_texels(texture->get(), quick ? 1000000 : 10000000, false);
  if (btfc_texture_pairs(texture->get()) > 1) random_texels(texture->get(), quick ? 1000000 : 10000000, true);
  return 0;
}
