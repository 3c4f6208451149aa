// Options -> fit -> chunks.
#include "encoder/models/gm_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "encoder/dataset/dataset_head.h"
#include "encoder/models/gm_checkpoint.h"
#include "encoder/models/gm_em.h"
#include "encoder/models/gm_refined.h"
#include "encoder/models/gm_samples.h"
#include "encoder/models/gm_score.h"
#include "encoder/run_on_threads.h"
#include "format/chunk_codec.h"
#include "format/models/gm_payload.h"

namespace btfc {
namespace {

constexpr OptionSpec kOwnOptions[] = {
    {"fit", "refined|em",
     "descent on the decoded error, or the paper's maximum likelihood (default refined)"},
    {"iterations", "N", "steps: of refined (default 16000), of em (default 40)"},
    {"time-limit", "S", "stop after so many seconds and say which --iterations give the same again"},
    {"epsilon", "E", "em: stop where the mean log-likelihood grows by less (default 0: never)"},
    {"share", "N", "em: see an N-th of the pairs an iteration, others each time (default 1: all)"},
    {"transform", "identity|log", "fit values, or log(1 + value) (default log for half floats)"},
    {"bytes", "N", "as many components as fit into N bytes of payload"},
    {"decode-cost", "N", "as many components as N operations a texel allow"},
    {"psnr", "P", "few components that reach P dB, by a search of a few fits"},
    {"checkpoint", "FILE", "keep the state of the fit there now and then; go on from it where it exists"},
};

constexpr auto all_options() {
  std::array<OptionSpec, std::size(kGmOptions) + std::size(kOwnOptions)> all{};
  std::copy(std::begin(kOwnOptions), std::end(kOwnOptions),
            std::copy(std::begin(kGmOptions), std::end(kGmOptions), all.begin()));
  return all;
}
constexpr auto kAllOptions = all_options();

constexpr std::uint32_t kStepsRefined = 16000, kStepsEm = 40;
constexpr std::uint32_t kSearchFirst = 32, kSearchMost = 16384;  // components, of --psnr
constexpr int kSearchSteps = 3;                                  // after that the interval is narrow enough

struct Settings {
  GmParm parm;
  bool em = false;
  std::uint32_t iterations = 0;
  double seconds = 0, epsilon = 0;  // 0: without
  std::uint32_t share = 1;
  ValueTransform transform = ValueTransform::identity;
  std::optional<double> psnr;
  std::string checkpoint;
};

// The most components whose payload fits; the mean BRDF takes an eighth of the bytes at most.
Result<Done> fit_bytes(const Head& head, std::uint32_t bytes, bool rank_is_given, GmParm& p) {
  const std::uint64_t bits = std::uint64_t{8} * bytes;
  if (p.mean == GmMeanForm::coded && !rank_is_given) {
    const std::uint64_t factor =
        gm_mean_bits(p.mean, head.views, head.lights, head.pairs, head.channels(), 1);
    p.mean_rank = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(bits / 8 / factor, 1, 8));
  }
  std::uint32_t low = 0, high = kGmMaxComponents + 1;  // low fits, high does not
  while (high - low > 1) {
    const std::uint32_t middle = (low + high) / 2;
    (gm_formula_bits(head, gm_with_components(p, middle)) <= bits ? low : high) = middle;
  }
  if (low == 0) {
    return bad_argument(fmt::format("--bytes {}: one component and the mean BRDF take {} bytes", bytes,
                                    gm_formula_bits(head, gm_with_components(p, 1)) / 8));
  }
  p = gm_with_components(p, low);
  return Done{};
}

// The most components, up to `most`, that so many operations a texel allow.
Result<Done> fit_cost(const Head& head, std::uint32_t operations, std::uint32_t most, GmParm& p) {
  const auto cost = [&](std::uint32_t components) {
    return gm_layout(head, write_gm_parm(gm_with_components(p, components)))->cost->operations;
  };
  if (cost(1) > operations) {
    return bad_argument(
        fmt::format("--decode-cost {}: one component takes {} operations", operations, cost(1)));
  }
  std::uint32_t low = 1, high = most + 1;  // low is allowed, high is not
  while (high - low > 1) {
    const std::uint32_t middle = (low + high) / 2;
    (cost(middle) <= operations ? low : high) = middle;
  }
  p = gm_with_components(p, low);
  return Done{};
}

Result<Settings> parse(const OptionValues& options, const DatasetInfo& info, const Head& head) {
  Settings s;
  const Result<GmParm> parm = gm_parm_from_options(options, info.type);
  if (!parm) return parm.error();
  s.parm = *parm;
  constexpr const char* kFits[] = {"refined", "em"};
  const auto fit = parse_choice(options, "fit", kFits);
  if (!fit) return fit.error();
  s.em = fit->value_or(0) == 1;
  const auto iterations = parse_u32(options, "iterations", 1, 100'000'000);
  if (!iterations) return iterations.error();
  const auto seconds = parse_double(options, "time-limit", 0.001, 1e7);
  if (!seconds) return seconds.error();
  if (*iterations && *seconds && !s.em)
    return bad_argument("--iterations and --time-limit: only one of them with --fit refined");
  s.seconds = seconds->value_or(0);
  s.iterations = iterations->value_or(s.em       ? (*seconds ? UINT32_MAX : kStepsEm)
                                      : *seconds ? 0
                                                 : kStepsRefined);
  const auto epsilon = parse_double(options, "epsilon", 0, 1e9);
  if (!epsilon) return epsilon.error();
  const auto share = parse_u32(options, "share", 1, 1024);
  if (!share) return share.error();
  if (!s.em && (*epsilon || *share)) return bad_argument("--epsilon and --share: only of --fit em");
  s.epsilon = epsilon->value_or(0);
  s.share = share->value_or(1);
  if (s.em && find_option(options, "shear") == "on")
    return bad_argument("--shear on: expectation maximisation has none");
  if (s.em) s.parm.shear = false;
  constexpr const char* kTransforms[] = {"identity", "log"};
  const auto transform = parse_choice(options, "transform", kTransforms);
  if (!transform) return transform.error();
  if (transform->value_or(info.type == SampleType::float16 ? 1 : 0) == 1) s.transform = ValueTransform::log;
  s.checkpoint = find_option(options, "checkpoint").value_or("");

  const auto bytes = parse_u32(options, "bytes", 1, UINT32_MAX);
  if (!bytes) return bytes.error();
  const auto cost = parse_u32(options, "decode-cost", 1, UINT32_MAX);
  if (!cost) return cost.error();
  const auto psnr = parse_double(options, "psnr", 1, 200);
  if (!psnr) return psnr.error();
  s.psnr = *psnr;
  if (find_option(options, "components") && (*bytes || *cost || *psnr))
    return bad_argument("--components: not together with --bytes, --decode-cost or --psnr");
  if (*psnr && (*bytes || *cost || !s.checkpoint.empty()))
    return bad_argument("--psnr: not together with --bytes, --decode-cost or --checkpoint");
  if (*bytes) {
    if (const auto ok = fit_bytes(head, **bytes, find_option(options, "mean-rank").has_value(), s.parm); !ok)
      return ok.error();
  }
  if (*cost) {
    const std::uint32_t most = *bytes ? s.parm.components : kGmMaxComponents;
    if (const auto ok = fit_cost(head, **cost, most, s.parm); !ok) return ok.error();
  }
  return s;
}

// What a fit gives: rows as they are stored, and the mixture as a decoder has it.
struct Fitted {
  CodedRows rows;
  GmMixture decoded;
  std::uint64_t iterations = 0;
  double log_likelihood = 0;  // of --fit em
};

// The paper's rows of any mixture: weights from the peaks; spreads of the outputs where they are known.
CodedRows paper_rows(const GmMixture& mixture, const GmEmMixture* em) {
  const std::size_t count = mixture.shape.components, channels = mixture.shape.channels;
  const std::size_t dims = kGmInputs + channels;
  std::vector<float> values((2 * dims + 1) * count);
  std::vector<double> weight(count);
  double sum = 0, most = -1e300;
  for (std::size_t m = 0; m < count; ++m) {
    weight[m] = double{mixture.row(kGmHeightRow)[m]};
    for (std::uint32_t n = 0; n < kGmInputs; ++n) {
      const float spread = mixture.row(kGmSpreadRow + n)[m];
      values[n * count + m] = mixture.row(kGmMeanRow + n)[m];
      values[(dims + n) * count + m] = std::exp2(spread);
      weight[m] += double{spread};
    }
    most = std::max(most, weight[m]);
    for (std::uint32_t c = 0; c < channels; ++c) {
      values[(kGmInputs + c) * count + m] = mixture.row(kGmOutputRow + c)[m];
      if (em != nullptr) {
        values[(dims + kGmInputs + c) * count + m] =
            static_cast<float>(em->spread[(kGmInputs + c) * count + m]);
      }
    }
  }
  for (double& w : weight) sum += w = std::exp2(w - most);
  for (std::size_t m = 0; m < count; ++m) values[2 * dims * count + m] = static_cast<float>(weight[m] / sum);
  return code_rows(values, 2 * dims + 1, count, Precision::f32);
}

// Rows of the layout, and what is read back from them.
Fitted stored(const GmParm& p, const GmCodes& codes, const GmEmMixture* em) {
  Fitted out;
  if (p.layout == GmLayout::paper) {
    out.rows = paper_rows(gm_dequantise(codes), em);
    out.decoded = gm_mixture_of_paper(out.rows, codes.shape.channels);
  } else {
    out.rows = codes.rows;
    out.decoded = gm_dequantise(codes);
  }
  return out;
}

GmEmMixture by_weight(const GmEmMixture& from) {
  std::vector<std::size_t> order(from.components);
  for (std::size_t m = 0; m < order.size(); ++m) order[m] = m;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return from.weight[a] > from.weight[b]; });
  GmEmMixture to = from;
  for (std::size_t m = 0; m < order.size(); ++m) {
    to.weight[m] = from.weight[order[m]];
    for (std::size_t n = 0; n < from.dimensions(); ++n) {
      to.mean[n * order.size() + m] = from.mean[n * order.size() + order[m]];
      to.spread[n * order.size() + m] = from.spread[n * order.size() + order[m]];
    }
  }
  return to;
}

// A hash of what a fit depends on: the samples by their shape, means and weights, and the options.
std::uint64_t identity_of(const GmSamples& samples, const FitSettings& settings) {
  std::string text = fmt::format("{} {} {} {} {}", samples.width, samples.height, samples.channels,
                                 samples.pairs.size(), settings.seed);
  for (const auto& [name, value] : settings.options) {
    if (name != "checkpoint") text += fmt::format(" {}={}", name, value);
  }
  for (const float v : samples.mean) text += fmt::format(" {:a}", v);
  for (const double w : samples.cumulative_weights) text += fmt::format(" {:a}", w);
  return content_hash(ByteView(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
}

// A state that cannot be kept is no reason to lose the fit.
void keep_state(const std::string& path, std::uint64_t identity, const Bytes& state,
                const FitSettings& settings) {
  const auto written = write_checkpoint(path, identity, state);
  if (!written && settings.note) settings.note(written.error().message);
}

Result<Fitted> fit_em(const GmSamples& samples, const Settings& s, const FitSettings& settings) {
  GmEmOptions o;
  o.components = s.parm.components;
  o.iterations = s.iterations;
  o.epsilon = s.epsilon;
  o.seconds = s.seconds;
  o.seed = settings.seed;
  o.every = s.share;
  o.progress = [&](std::uint32_t iteration, double likelihood, double seconds) {
    if (settings.progress && s.iterations != UINT32_MAX) settings.progress(iteration, s.iterations);
    if (settings.note)
      settings.note(
          fmt::format("iteration {}, {:.1f} s, mean log-likelihood {:.5f}", iteration, seconds, likelihood));
  };
  GmEmFit start;
  std::function<void(const GmEmFit&)> step;
  if (!s.checkpoint.empty()) {
    const std::uint64_t identity = identity_of(samples, settings);
    const Result<Bytes> state = begin_checkpoint(s.checkpoint, identity);
    if (!state) return state.error();
    if (!state->empty()) {
      std::optional<GmEmFit> kept = gm_em_fit_of(*state);
      if (!kept) return bad_data(fmt::format("'{}': the state of another fit", s.checkpoint));
      start = *std::move(kept);
    }
    step = [&, identity](const GmEmFit& fit) {
      keep_state(s.checkpoint, identity, gm_em_state(fit), settings);
    };
  }
  if (start.mixture.components == 0) start.mixture = gm_em_random(samples, o.components, o.seed);
  const GmEmFit fit = gm_continue_em(samples, std::move(start), o, step);
  const GmEmMixture mixture = by_weight(fit.mixture);
  const GmMixture decoded = gm_em_decoded(mixture);
  Fitted out = stored(s.parm, gm_quantise(decoded, s.parm.precision), &mixture);
  out.iterations = fit.iterations;
  out.log_likelihood = fit.log_likelihood.empty() ? 0 : fit.log_likelihood.back();
  return out;
}

Result<Fitted> fit_refined(const GmSamples& samples, const Settings& s, const FitSettings& settings) {
  GmRefinedOptions o;
  o.components = s.parm.components;
  o.iterations = s.iterations;
  o.seconds = s.seconds;
  o.gates = s.parm.gates;
  o.shear = s.parm.shear;
  o.precision = s.parm.precision;
  o.seed = settings.seed;
  o.progress = [&](const GmProgress& p) {
    if (settings.progress && p.iterations > 0) settings.progress(p.iteration, p.iterations);
    if (settings.note)
      settings.note(fmt::format("step {}, {:.1f} s, {} components, {:.2f} dB", p.iteration, p.seconds,
                                p.components, p.psnr_db));
  };
  if (!s.checkpoint.empty()) {
    const std::uint64_t identity = identity_of(samples, settings);
    Result<Bytes> state = begin_checkpoint(s.checkpoint, identity);
    if (!state) return state.error();
    o.resume = *std::move(state);
    o.save = [&, identity](const Bytes& now) { keep_state(s.checkpoint, identity, now, settings); };
  }
  const std::optional<GmRefined> fit = gm_fit_refined(samples, o);
  if (!fit) return bad_data(fmt::format("'{}': the state of another fit", s.checkpoint));
  Fitted out = stored(s.parm, fit->codes, nullptr);
  out.iterations = fit->iterations;
  return out;
}

struct Scored {
  Fitted fitted;
  double psnr_db = 0;
};

Result<Scored> fit_and_score(const GmSamples& samples, const Settings& s, const FitSettings& settings) {
  Result<Fitted> fitted = s.em ? fit_em(samples, s, settings) : fit_refined(samples, s, settings);
  if (!fitted) return fitted.error();
  const double psnr = gm_psnr(samples, fitted->decoded, s.parm.gates);
  return Scored{*std::move(fitted), psnr};
}

// Doubles the components until the PSNR is reached, or halves them while it is, and then narrows the interval
// by geometric means.
Result<Scored> search_psnr(const GmSamples& samples, Settings& s, const FitSettings& settings) {
  const GmParm wanted = s.parm;
  const auto tried = [&](std::uint32_t components) {
    s.parm = gm_with_components(wanted, components);
    Result<Scored> scored = fit_and_score(samples, s, settings);
    if (scored && settings.note)
      settings.note(fmt::format("{} components: {:.3f} dB", components, scored->psnr_db));
    return scored;
  };
  std::uint32_t low = 0, high = kSearchFirst;  // low does not reach it, high does
  Result<Scored> best = tried(high);
  while (best && best->psnr_db < *s.psnr) {
    low = high;
    high *= 2;
    if (high > kSearchMost) {
      return bad_data(fmt::format("--psnr {:g}: {} components reach {:.2f} dB", *s.psnr, low, best->psnr_db));
    }
    best = tried(high);
  }
  for (int step = 0; best && step < kSearchSteps && high - low > 1; ++step) {
    const auto middle =
        static_cast<std::uint32_t>(std::lround(std::sqrt(std::max(low, 1u) * static_cast<double>(high))));
    if (middle <= low || middle >= high) break;
    Result<Scored> between = tried(middle);
    if (!between) return between;
    if (between->psnr_db >= *s.psnr) {
      high = middle;
      best = std::move(between);
    } else {
      low = middle;
    }
  }
  s.parm = gm_with_components(wanted, high);
  return best;
}

}  // namespace

const std::span<const OptionSpec> kGmFitOptions = kAllOptions;

Result<FitResult> gm_fit(const FitInput& input, const FitSettings& settings) {
  const Dataset& dataset = *input.dataset;
  Result<DatasetHead> described = dataset_head(dataset.info(), ModelId::gm);
  if (!described) return described.error();
  Head& head = described->head;
  if (head.channels() > kGmMaxChannels) {
    return bad_data(fmt::format("the data set has {} channels, model gm takes at most {}", head.channels(),
                                kGmMaxChannels));
  }
  Result<Settings> parsed = parse(settings.options, dataset.info(), head);
  if (!parsed) return parsed.error();
  Settings& s = *parsed;
  head.value_transform = s.transform;
  if (const auto fits = read_gm_parm(head, write_gm_parm(s.parm)); !fits) return fits.error();

  GmMean mean;
  Result<Scored> scored = bad_argument("");
  run_on_threads(settings.threads, [&] {
    GmSamples samples = gm_samples(dataset, s.transform, s.parm.onion);
    mean = gm_code_mean(samples, gm_mean_table(samples), s.parm.mean, s.parm.mean_rank);
    samples.mean = gm_decoded_mean(samples, mean);
    scored = s.psnr ? search_psnr(samples, s, settings) : fit_and_score(samples, s, settings);
  });
  if (!scored) return scored.error();

  FitResult result;
  const Fitted& fitted = scored->fitted;
  result.chunks = gm_write(head, s.parm, {described->directions, fitted.rows, mean});
  result.meta["gm.fit"] = s.em ? "em" : "refined";
  result.meta["gm.seed"] = std::to_string(settings.seed);
  result.meta["gm.iterations"] = std::to_string(fitted.iterations);
  result.report = {{"components", std::to_string(s.parm.components)},
                   {"iterations", std::to_string(fitted.iterations)},
                   {"psnr_db", fmt::format("{:.4f}", scored->psnr_db)}};
  if (s.em) result.report.push_back({"log_likelihood", fmt::format("{:.6f}", fitted.log_likelihood)});
  return result;
}

}  // namespace btfc
