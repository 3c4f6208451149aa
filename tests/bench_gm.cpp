// btfc_bench_gm DIRECTORY [--option value …]: fits model gm to a data set and prints PSNR, bytes and seconds.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include "encoder/input/dataset_read.h"
#include "encoder/models/gm_gradient.h"
#include "encoder/models/gm_refined.h"
#include "encoder/models/gm_samples.h"
#include "encoder/run_on_threads.h"

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

double psnr_of(const GmSamples& samples, const GmMixture& mixture, std::uint32_t gates) {
  const GmField field = gm_field(mixture, samples.width, samples.height, samples.wraps);
  std::vector<double> squares(samples.groups.size());
  GmGradientOptions options;
  options.gradient = false;
  options.gates = gates;
  tbb::parallel_for(std::size_t{0}, samples.groups.size(), [&](std::size_t g) {
    GmScratch scratch;
    GmSums sums;
    for (std::uint32_t y = 0; y < samples.height; y += kGmTile) {
      for (std::uint32_t x = 0; x < samples.width; x += kGmTile) {
        const GmVisit visit{x,
                            y,
                            std::min(kGmTile, samples.width - x),
                            std::min(kGmTile, samples.height - y),
                            &samples.groups[g],
                            samples.groups[g].pairs};
        gm_add_gradient(field, samples, visit, options, scratch, sums);
      }
    }
    squares[g] = sums.squared_error;
  });
  double sum = 0;
  for (const double s : squares) sum += s;
  return -10 * std::log10(sum / (static_cast<double>(samples.count()) * samples.channels));
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
    GmRefinedOptions o;
    o.components = static_cast<std::uint32_t>(number(given, "components", 600));
    o.iterations = static_cast<std::uint64_t>(number(given, "iterations", 0));
    o.seconds = number(given, "seconds", 30);
    o.gates = static_cast<std::uint32_t>(number(given, "gates", 0));
    o.shear = number(given, "shear", 1) != 0;
    o.precision = static_cast<GmPrecision>(static_cast<int>(number(given, "precision", 2)));
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
        fmt::print("row {:2}: {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f} {:8.3f}\n", r, v[0], v[v.size() / 100], v[v.size() / 10],
                   v[v.size() / 2], v[v.size() * 9 / 10], v[v.size() * 99 / 100], v.back());
      }
    };
    const GmRefined fit = gm_fit_refined(samples, o);
    const double seconds = now() - begin;
    const GmPayload payload{fit.codes, mean};
    if (number(given, "ranges", 0) != 0) print_ranges(gm_dequantise(fit.codes));
    const double psnr = psnr_of(samples, gm_dequantise(fit.codes), o.gates);
    fmt::print("{} M {} bytes {} psnr {:.3f} dB, {} steps, {:.1f} M samples, {:.1f} s, check {:.1f} s\n",
               argv[1], o.components, gm_formula_bits(payload) / 8, psnr, fit.iterations,
               static_cast<double>(fit.samples) / 1e6, seconds, now() - begin - seconds);
  });
  return status;
}
