// btfc_bench_gm DIRECTORY [--option value …]: fits model gm to a data set and prints PSNR, bytes and seconds.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <string>

#include "encoder/input/dataset_read.h"
#include "encoder/models/gm_em.h"
#include "encoder/models/gm_gradient.h"
#include "encoder/models/gm_refined.h"
#include "encoder/models/gm_samples.h"
#include "encoder/models/gm_score.h"
#include "encoder/run_on_threads.h"
#include "encoder/split_mix.h"
#include "format/models/gm_evaluate.h"

using namespace btfc;

namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

using Options = std::map<std::string, std::string>;
double number(const Options& options, const std::string& name, double otherwise) {
  const auto found = options.find(name);
  return found == options.end() ? otherwise : std::stod(found->second);
}

std::uint64_t mean_bytes(const GmMean& mean) {
  return gm_mean_bits(mean.form, mean.views, mean.lights, mean.pairs, mean.channels, mean.rank) / 8;
}

// Evaluation against the plain loop, one thread each: 800x800 texels under one pair, and random queries of
// 8 gates.
void decode_rates(const GmSamples& samples, const GmMixture& mixture, float error) {
  const GmField field = gm_field(mixture, samples.width, samples.height, samples.wraps);
  constexpr std::uint32_t kSide = 800, kPlain = 20000, kQueries = 2000000;
  std::vector<float> xs, ys;
  for (std::uint32_t i = 0; i < kSide; ++i) {
    xs.push_back((static_cast<float>(i) + 0.5f) * field.width / kSide);
    ys.push_back((static_cast<float>(i) + 0.5f) * field.height / kSide);
  }
  const std::size_t pair = samples.pairs.size() * 2 / 3;
  std::vector<float> image(std::size_t{kSide} * kSide * samples.channels);
  const auto seconds = [](const auto& work) {
    const std::clock_t begin = std::clock();
    work();
    return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  const double fast = seconds([&] {
    std::vector<float> rows;
    const GmSlice slice = gm_slice(field, samples.pairs[pair], 0, vec4(0), error, rows);
    gm_evaluate_image(slice, xs, ys, {0, error}, image);
  });
  std::vector<GmQuery> queries;
  for (std::uint32_t i = 0; i < kPlain; ++i) {
    const std::size_t at = std::size_t{i} * 31 % (std::size_t{kSide} * kSide);
    queries.push_back({xs[at % kSide], ys[at / kSide], samples.pairs[pair]});
  }
  std::vector<float> plain(std::size_t{kPlain} * samples.channels);
  const double slow = seconds([&] { gm_evaluate_plain(field, queries, 0, plain); }) / kPlain;
  double worst = 0;
  for (std::uint32_t i = 0; i < kPlain; ++i) {
    const std::size_t at = std::size_t{i} * 31 % (std::size_t{kSide} * kSide);
    for (std::uint32_t c = 0; c < samples.channels; ++c) {
      worst = std::max(worst, std::fabs(double{plain[std::size_t{i} * samples.channels + c]} -
                                        double{image[at * samples.channels + c]}));
    }
  }
  const double texels = double{kSide} * kSide;
  fmt::print(
      "image {}x{}: {:.3f} s, {:.2f} Mtexel/s, plain {:.4f} Mtexel/s, ratio {:.0f}, worst error {:.2e}\n",
      kSide, kSide, fast, texels / fast / 1e6, 1e-6 / slow, slow * texels / fast, worst);
  SplitMix64 random(5);
  queries.resize(kQueries);
  for (GmQuery& q : queries) {
    q.x = field.width * static_cast<float>(random.uniform());
    q.y = field.height * static_cast<float>(random.uniform());
    q.directions = samples.pairs[random.below(samples.pairs.size())];
  }
  std::vector<float> batch(std::size_t{kQueries} * samples.channels);
  const double sorted = seconds([&] { gm_evaluate_batch(field, queries, {8, 1e-3f}, batch); }) / kQueries;
  const double one =
      seconds([&] { gm_evaluate_plain(field, std::span(queries).first(kPlain), 8, plain); }) / kPlain;
  double square = 0;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const double d = double{plain[i]} - double{batch[i]};
    square += d * d;
  }
  fmt::print("random queries, 8 gates: {:.2f} Mtexel/s, plain {:.4f}, ratio {:.0f}, rms difference {:.2e}\n",
             1e-6 / sorted, 1e-6 / one, one / sorted, std::sqrt(square / static_cast<double>(plain.size())));
}

// Expectation maximisation; with --plain 1 also the plain loop beside a pass, in the same run.
void fit_em(const GmSamples& samples, const Options& given) {
  GmEmOptions o;
  o.components = static_cast<std::uint32_t>(number(given, "components", 600));
  o.iterations = static_cast<std::uint32_t>(number(given, "iterations", 40));
  o.every = static_cast<std::uint32_t>(number(given, "every", 1));
  o.seed = static_cast<std::uint64_t>(number(given, "seed", 1));
  o.reach = static_cast<float>(number(given, "reach", double{o.reach}));
  o.progress = [](std::uint32_t iteration, double likelihood, double seconds) {
    fmt::print("  iteration {:3}  {:6.1f} s  log-likelihood {:.5f}\n", iteration, seconds, likelihood);
    std::fflush(stdout);
  };
  const GmEmMixture start = gm_em_random(samples, o.components, o.seed);
  if (number(given, "plain", 0) != 0) {
    const double begin = now();
    const GmEmSums plain = gm_em_pass_plain(samples, start, 0, 4);
    const double middle = now();
    const std::clock_t cpu = std::clock();
    const GmEmSums fast = gm_em_pass(samples, start, {o.reach, 16, 0});
    const double end = now();
    const double cpu_seconds = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
    const double plain_rate = static_cast<double>(plain.samples) * o.components / (middle - begin);
    const double fast_rate = static_cast<double>(fast.samples) * o.components / (end - middle);
    fmt::print(
        "component-samples a second: plain {:.4g}, fast {:.4g} (ratio {:.1f}; a processor's second {:.4g}), "
        "listed {:.1f}\n",
        plain_rate, fast_rate, fast_rate / plain_rate,
        static_cast<double>(fast.samples) * o.components / cpu_seconds,
        static_cast<double>(fast.listed) / static_cast<double>(fast.samples));
  }
  const double begin = now();
  const std::clock_t cpu = std::clock();
  const GmEmFit fit = gm_fit_em(samples, start, o);
  const double seconds = now() - begin,
               cpu_seconds = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
  const GmEmSums all = gm_em_pass(samples, fit.mixture, {});
  const double psnr = gm_psnr(samples, gm_em_decoded(fit.mixture), 0);
  fmt::print(
      "em M {} every {}: psnr {:.3f} dB, likelihood of all {:.5f}, {} iterations, {} reseeded, {:.1f} s, of "
      "processors {:.1f} s\n",
      o.components, o.every, psnr, all.log_likelihood / static_cast<double>(all.samples), fit.iterations,
      fit.reseeded, seconds, cpu_seconds);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return 1;
  Options given;
  for (int i = 2; i + 1 < argc; i += 2) given[std::string(argv[i]).substr(2)] = argv[i + 1];
  int status = 0;
  run_on_threads(static_cast<unsigned>(number(given, "threads", 0)), [&] {
    const auto read = read_dataset(argv[1], {});
    if (!read) {
      status = 1;
      return;
    }
    GmSamples samples = gm_samples(read->dataset);
    const auto rank = static_cast<std::uint32_t>(number(given, "rank", 8));
    const auto table = gm_mean_table(samples);
    const GmMean mean = gm_code_mean(samples, table, GmMeanForm::coded, rank);
    samples.mean = gm_decoded_mean(samples, mean);
    double worst = 0, square = 0;
    for (std::size_t i = 0; i < table.size(); ++i) {
      const double d = double{samples.mean[i]} - double{table[i]};
      worst = std::max(worst, std::fabs(d));
      square += d * d;
    }
    fmt::print("mean: rank {}, rms error {:.4f}, worst {:.4f}; {} groups of pairs\n", rank,
               std::sqrt(square / static_cast<double>(table.size())), worst, samples.groups.size());
    if (given["fit"] == "em") {
      fit_em(samples, given);
      return;
    }
    GmRefinedOptions o;
    o.components = static_cast<std::uint32_t>(number(given, "components", 600));
    o.shear = number(given, "shear", 1) != 0;
    if (number(given, "bytes", 0) > 0) {
      // What is left for u8 components beside the mean, the ranges and a head of at most 256 bytes.
      const GmShape shape{0, samples.channels, o.shear};
      const double left = number(given, "bytes", 0) - 256 - static_cast<double>(mean_bytes(mean)) -
                          static_cast<double>(gm_mixture_bits(shape, Precision::u8)) / 8;
      o.components = static_cast<std::uint32_t>(left / shape.rows());
    }
    o.iterations = static_cast<std::uint64_t>(number(given, "iterations", 0));
    o.seconds = number(given, "seconds", 30);
    o.gates = static_cast<std::uint32_t>(number(given, "gates", 0));
    o.shear = number(given, "shear", 1) != 0;
    o.precision = static_cast<Precision>(static_cast<int>(number(given, "precision", 2)));
    o.rate = static_cast<float>(number(given, "rate", 1));
    o.visits = static_cast<std::uint32_t>(number(given, "visits", o.visits));
    o.pairs_per_visit = static_cast<std::uint32_t>(number(given, "pairs", o.pairs_per_visit));
    o.first_components = static_cast<std::uint32_t>(number(given, "first", o.first_components));
    o.split_every = static_cast<std::uint32_t>(number(given, "split", o.split_every));
    o.growth = static_cast<float>(number(given, "growth", double{o.growth}));
    o.reach = static_cast<float>(number(given, "reach", double{o.reach}));
    o.seed = static_cast<std::uint64_t>(number(given, "seed", 1));
    if (number(given, "quiet", 0) == 0) {
      o.progress = [](const GmProgress& p) {
        fmt::print("  {:6} steps {:5.1f} s  M {:5}  listed {:6.1f}  {:.3f} dB\n", p.iteration, p.seconds,
                   p.components, p.listed, p.psnr_db);
        std::fflush(stdout);
      };
    }
    const double begin = now();
    const auto print_ranges = [&](const GmMixture& mixture) {
      for (std::uint32_t r = 0; r <= mixture.shape.rows(); ++r) {
        std::vector<float> v;
        for (std::uint32_t m = 0; m < mixture.shape.components; ++m) {
          if (r < mixture.shape.rows()) {
            v.push_back(mixture.row(r)[m]);
          } else {
            float w = mixture.row(12)[m];
            for (std::uint32_t n = 0; n < 6; ++n) w += mixture.row(6 + n)[m];
            v.push_back(w);
          }
        }
        std::sort(v.begin(), v.end());
        fmt::print("row {:2}: {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f}\n", r, v[0],
                   v[v.size() / 100], v[v.size() / 10], v[v.size() / 2], v[v.size() * 9 / 10],
                   v[v.size() * 99 / 100], v.back());
      }
    };
    const std::clock_t cpu = std::clock();
    const GmRefined fit = *gm_fit_refined(samples, o);
    const double seconds = now() - begin;
    const double cpu_seconds = static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC;
    if (number(given, "ranges", 0) != 0) print_ranges(gm_dequantise(fit.codes));
    const double psnr = gm_psnr(samples, gm_dequantise(fit.codes), o.gates);
    if (number(given, "decode", 0) != 0)
      decode_rates(samples, gm_dequantise(fit.codes), static_cast<float>(number(given, "error", 1e-4)));
    fmt::print(
        "{} M {} bytes {} psnr {:.3f} dB, {} steps, {:.1f} M samples, {:.1f} s, of processors {:.1f} s, "
        "check {:.1f} s\n",
        argv[1], o.components, gm_mixture_bits(fit.codes.shape, o.precision) / 8 + mean_bytes(mean), psnr,
        fit.iterations, static_cast<double>(fit.samples) / 1e6, seconds, cpu_seconds,
        now() - begin - seconds);
  });
  return status;
}
