// Predicting from a part, fitting the whole, learning from what was off.
#include "tools/auto_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "encoder/dataset/dataset_head.h"
#include "format/options.h"
#include "tools/dataset_part.h"
#include "tools/setting_family.h"
#include "tools/trade_points.h"

namespace btfc {
namespace {

constexpr std::size_t kSampleViews = 12, kSamplePairs = 1000;
constexpr std::uint32_t kSampleSide = 128;
constexpr std::size_t kLadderSteps = 3, kMostFits = 8;
constexpr double kNearDb = 0.5;

// A setting of a family, and what is expected of it. Without a dial the number is 0.
struct Candidate {
  std::size_t family = 0;
  std::uint32_t dial = 0;
  Expected expected;
  bool reaches = false;
};

struct Fitted {
  Candidate candidate;
  FitResult result;
  Expected measured;
};

std::string without(const std::string& options, const char* dial) {
  if (dial == nullptr) return options;
  std::string text;
  for (const auto& [name, value] : parse_options(options)) {
    if (name != dial) text += fmt::format("{}--{} {}", text.empty() ? "" : " ", name, value);
  }
  return text;
}

std::string options_text(const SettingFamily& family, std::uint32_t dial) {
  if (family.dial.empty()) return family.options;
  return fmt::format("{}{}--{} {}", family.options, family.options.empty() ? "" : " ", family.dial, dial);
}

// The points of a trade-off of the part, as they would be of the whole, by family.
Result<std::vector<SettingFamily>> families_of(const Trade& trade, const FitInput& input) {
  std::map<std::pair<std::string, std::string>, SettingFamily> families;
  for (const TradePoint& p : trade.points) {
    const std::optional<double> judged = p.judged();
    if (!judged || p.is.knobs.gates != 0 || p.is.knobs.culling > 0) continue;
    const Fitter& fit = fitter(p.model->id);
    if (fit.dial == nullptr && p.is.knobs.levels != 0) continue;
    ByteView bytes(trade.files[p.file].bytes);
    const Result<OpenedFile> file = open_file(memory_source(&bytes));
    if (!file) return file.error();
    // HEAD of the whole input, as the file of the part has it.
    Head head = file->head;
    if (input.dataset != nullptr) describe_tile(input.dataset->info(), head);
    Bytes parm = file->parm;
    if (p.model->reduced != nullptr) {
      Result<Bytes> reduced = p.model->reduced(head, parm, p.is.knobs);
      if (!reduced) return reduced.error();
      parm = *std::move(reduced);
    }
    const Result<Layout> layout = p.model->layout(head, parm);
    if (!layout) return layout.error();
    FamilyPoint point;
    point.own = p.is.knobs.levels == 0;
    point.is.quality = -*judged;
    point.is.bytes = static_cast<double>(payload_bytes(*layout));
    const std::optional<TexelCost> cost = layout->prepared_cost ? layout->prepared_cost : layout->cost;
    point.is.operations = cost ? static_cast<double>(cost->operations) : 0;
    if (fit.dial != nullptr) {
      const auto found = std::find_if(layout->parameters.begin(), layout->parameters.end(),
                                      [&](const Parameter& q) { return q.name == fit.dial; });
      if (found != layout->parameters.end()) point.dial = std::stod(found->value);
    }
    const std::string options = without(p.options, fit.dial);
    SettingFamily& family = families[{p.model->name, options}];
    family.model = p.model->name;
    family.options = options;
    family.dial = fit.dial == nullptr ? "" : fit.dial;
    family.points.push_back(point);
  }
  std::vector<SettingFamily> list;
  for (auto& [key, family] : families) {
    family.points = telling_points(std::move(family.points));
    list.push_back(std::move(family));
  }
  return list;
}

bool reaches(const Expected& e, const Target& t) {
  if (t.kind == TargetKind::psnr) return e.quality >= t.value;
  return (t.kind == TargetKind::bytes ? e.bytes : e.operations) <= t.value;
}

// The best of a family: of PSNR the least dial that reaches it, of a bound the most that keeps it. Where none
// does, the end that is nearest.
Candidate best_of(const std::vector<SettingFamily>& families, std::size_t number, const Target& target) {
  const SettingFamily& f = families[number];
  const auto candidate = [&](double dial) {
    const Expected e = f.at(dial);
    return Candidate{number, static_cast<std::uint32_t>(dial), e, reaches(e, target)};
  };
  if (f.dial.empty()) return candidate(f.points.front().dial);
  double low = f.least_dial(), high = f.most_dial();
  if (target.kind == TargetKind::psnr) {
    if (!candidate(high).reaches) return candidate(high);
    while (high - low > 1) {
      const double middle = std::floor((low + high) / 2);
      (candidate(middle).reaches ? high : low) = middle;
    }
    return candidate(low).reaches ? candidate(low) : candidate(high);
  }
  if (!candidate(low).reaches) return candidate(low);
  while (high - low > 1) {
    const double middle = std::floor((low + high) / 2);
    (candidate(middle).reaches ? low : high) = middle;
  }
  return candidate(high).reaches ? candidate(high) : candidate(low);
}

// The best first: of PSNR the smallest that reaches it, of a bound the best that keeps it, where those within
// `alike` of the best count as it and the smallest of them comes first.
std::vector<Candidate> ranked(const std::vector<SettingFamily>& families, const Target& target,
                              double alike) {
  std::vector<Candidate> list;
  for (std::size_t f = 0; f < families.size(); ++f) list.push_back(best_of(families, f, target));
  double best = -HUGE_VAL;
  for (const Candidate& c : list) {
    if (c.reaches) best = std::max(best, c.expected.quality);
  }
  const auto key = [&](const Candidate& c) {
    const double excess = target.kind == TargetKind::bytes        ? c.expected.bytes
                          : target.kind == TargetKind::operations ? c.expected.operations
                                                                  : -c.expected.quality;
    if (!c.reaches) return std::pair(2, excess);
    if (target.kind == TargetKind::psnr || c.expected.quality >= best - alike)
      return std::pair(0, c.expected.bytes);
    return std::pair(1, -c.expected.quality);
  };
  std::stable_sort(list.begin(), list.end(),
                   [&](const Candidate& a, const Candidate& b) { return key(a) < key(b); });
  return list;
}

// Whether what was measured may be handed out.
bool good_enough(const Expected& e, const Target& target) {
  return target.kind == TargetKind::psnr ? e.quality >= target.value - kNearDb : reaches(e, target);
}

class Search {
 public:
  Search(const FitInput& input, const FitSettings& settings, const Target& target, const Reference& reference,
         std::vector<SettingFamily> families)
      : input_(input),
        settings_(settings),
        target_(target),
        reference_(reference),
        families_(std::move(families)) {}

  Result<AutomaticFit> run();

 private:
  bool by_distance() const { return input_.dataset == nullptr; }
  std::string describe(const Expected& e) const {
    const std::string quality = by_distance() ? fmt::format("texture distance {:.3f}", -e.quality)
                                              : fmt::format("{:.2f} dB", e.quality);
    return fmt::format("{}, {:.0f} bytes, {:.0f} operations", quality, e.bytes, e.operations);
  }
  std::string name(const Candidate& c) const {
    const SettingFamily& f = families_[c.family];
    const std::string options = options_text(f, c.dial);
    return options.empty() ? f.model : f.model + " " + options;
  }
  Json json_of(const Expected& e) const {
    return {{by_distance() ? "texture_distance" : "psnr_db", by_distance() ? -e.quality : e.quality},
            {"payload_bytes", std::llround(e.bytes)},
            {"operations", std::llround(e.operations)}};
  }
  Json json_of(const Candidate& c) const {
    const SettingFamily& f = families_[c.family];
    return {{"model", f.model}, {"options", options_text(f, c.dial)}, {"predicted", json_of(c.expected)}};
  }
  Result<Done> fit(const Candidate& candidate);
  void doubt_others();
  std::optional<std::size_t> chosen() const;

  const FitInput& input_;
  const FitSettings& settings_;
  const Target& target_;
  const Reference& reference_;
  std::vector<SettingFamily> families_;
  std::vector<Fitted> fits_;
};

// Fits the whole input, measures, and mends what the family predicts.
Result<Done> Search::fit(const Candidate& candidate) {
  SettingFamily& family = families_[candidate.family];
  const ModelFormat& model = *find_model(family.model);
  FitSettings settings = settings_;
  settings.options = parse_options(options_text(family, candidate.dial));
  Result<FitResult> result = fitter(model.id).fit(input_, settings);
  if (!result) return result.error();
  const Result<Bytes> packed = pack_file(result->chunks, {.codec = Codec::raw});  // only to be measured
  if (!packed) return packed.error();
  ByteView bytes(*packed);
  const Result<OpenedFile> file = open_file(memory_source(&bytes));
  if (!file) return file.error();
  const Result<TexturePtr> texture = load_texture(bytes);
  if (!texture) return texture.error();
  const bool keeps = fitter(model.id).keeps_texels;
  const Result<MeasuredError> error = reference_.measure(file->head, texture->get(), keeps, false);
  if (!error) return error.error();
  const std::optional<double> judged = btfc::judged(*error, keeps);
  if (!judged) return Error{Status::failed, "no measure says anything of this input", "", 0};
  const Layout& layout = file->layout;
  const std::optional<TexelCost> cost = layout.prepared_cost ? layout.prepared_cost : layout.cost;
  const Expected measured = {-*judged, static_cast<double>(file->directory.header.payload_bytes),
                             cost ? static_cast<double>(cost->operations) : 0};
  family.learn(candidate.dial, measured);
  fits_.push_back({candidate, *std::move(result), measured});
  doubt_others();
  return Done{};
}

// A part is easier to fit than the whole: what the predictions of all fitted families were too good by at the
// least, the others' are taken to be too.
void Search::doubt_others() {
  double least = -HUGE_VAL;
  for (const SettingFamily& f : families_) {
    for (const FamilyPoint& p : f.off) least = std::max(least, p.is.quality);
  }
  for (SettingFamily& f : families_) f.doubt = std::min(least, 0.0);
}

// Of what is good enough: for PSNR the smallest, else the best.
std::optional<std::size_t> Search::chosen() const {
  std::optional<std::size_t> best;
  const auto key = [&](const Fitted& f) {
    return target_.kind == TargetKind::psnr ? f.measured.bytes : -f.measured.quality;
  };
  for (std::size_t i = 0; i < fits_.size(); ++i) {
    if (good_enough(fits_[i].measured, target_) && (!best || key(fits_[i]) < key(fits_[*best]))) best = i;
  }
  return best;
}

Result<AutomaticFit> Search::run() {
  AutomaticFit out;
  const std::vector<Candidate> first = ranked(families_, target_, by_distance() ? kAlikeDistance : kAlikeDb);
  Json candidates = Json::array();
  for (const Candidate& c : first) {
    candidates.push_back(json_of(c));
    out.text += fmt::format("{} {:<64} {}\n", c.reaches ? ' ' : '-', name(c), describe(c.expected));
  }
  while (fits_.size() < kMostFits) {
    const Candidate best = ranked(families_, target_, by_distance() ? kAlikeDistance : kAlikeDb).front();
    const auto same = [&](const Fitted& f) {
      return f.candidate.family == best.family && f.candidate.dial == best.dial;
    };
    if (std::any_of(fits_.begin(), fits_.end(), same)) break;
    if (settings_.note) settings_.note("fitting " + name(best));
    if (const auto ok = fit(best); !ok) return ok.error();
    const Fitted& f = fits_.back();
    out.text += fmt::format("fitted {}: {}; predicted {}\n", name(best), describe(f.measured),
                            describe(best.expected));
    const bool near = target_.kind == TargetKind::psnr && f.measured.quality <= target_.value + kNearDb;
    if (near && good_enough(f.measured, target_)) break;
  }
  const std::optional<std::size_t> best = chosen();
  if (!best) {
    const auto nearest = std::min_element(fits_.begin(), fits_.end(), [&](const Fitted& a, const Fitted& b) {
      if (target_.kind == TargetKind::psnr) return a.measured.quality > b.measured.quality;
      if (target_.kind == TargetKind::bytes) return a.measured.bytes < b.measured.bytes;
      return a.measured.operations < b.measured.operations;
    });
    const char* wanted[] = {"dB", "bytes", "operations"};
    return Error{Status::failed,
                 fmt::format("no model reaches {:g} {} on this input; the nearest is {} with {}",
                             target_.value, wanted[static_cast<std::size_t>(target_.kind)],
                             name(nearest->candidate), describe(nearest->measured)),
                 "", 0};
  }
  Json fits = Json::array();
  for (const Fitted& f : fits_) {
    fits.push_back(json_of(f.candidate));
    fits.back()["measured"] = json_of(f.measured);
  }
  const char* wanted[] = {"psnr_db", "bytes", "operations"};
  out.reasons = {{"target", {{wanted[static_cast<std::size_t>(target_.kind)], target_.value}}},
                 {"candidates", candidates},
                 {"fits", fits},
                 {"chosen", *best}};
  const Fitted& f = fits_[*best];
  out.text += fmt::format("chosen: {}", name(f.candidate));
  out.model = find_model(families_[f.candidate.family].model);
  out.fitted = std::move(fits_[*best].result);
  return out;
}

}  // namespace

Result<Target> target_of(const OptionValues& options) {
  constexpr std::pair<const char*, TargetKind> kTargets[] = {
      {"psnr", TargetKind::psnr}, {"bytes", TargetKind::bytes}, {"decode-cost", TargetKind::operations}};
  std::optional<Target> target;
  for (const auto& [name, kind] : kTargets) {
    if (!options.contains(name)) continue;
    if (target) return bad_argument("--model auto takes one of --psnr, --bytes and --decode-cost");
    const auto value = parse_double(options, name, kind == TargetKind::psnr ? 1 : 16,
                                    kind == TargetKind::psnr ? 150 : 4294967295.0);
    if (!value) return value.error();
    target = Target{kind, **value};
  }
  if (!target) return bad_argument("--model auto needs one of --psnr P, --bytes N and --decode-cost N");
  if (options.size() > 1) {
    const auto other = std::find_if(options.begin(), options.end(), [&](const auto& o) {
      return o.first != "psnr" && o.first != "bytes" && o.first != "decode-cost";
    });
    return bad_argument(
        fmt::format("--{} is an option of single models, --model auto chooses it", other->first));
  }
  return *target;
}

Result<AutomaticFit> fit_automatically(const FitInput& input, const FitSettings& settings,
                                       const Target& target, const std::string& scratch_directory) {
  const auto begin = std::chrono::steady_clock::now();
  if (input.dataset == nullptr && target.kind == TargetKind::psnr) {
    return bad_argument(
        "--psnr: the models of images do not keep texels in place, so that PSNR says nothing of them; take "
        "--bytes or --decode-cost, for which the distance of textures decides");
  }
  std::vector<SettingFamily> families;
  std::size_t sample_pairs = 0;
  for (const bool views_apart : {false, true}) {
    TradeOptions options;
    for (const ModelFormat& model : models()) {
      const Fitter& fit = fitter(model.id);
      // Of a data set only what reproduces its images; of an image there is no such model.
      if (takes(fit, input) && fit.keeps_texels == (input.dataset != nullptr) &&
          fit.views_apart == views_apart)
        options.models.push_back(model.id);
    }
    if (options.models.empty()) continue;
    options.seed = settings.seed;
    options.threads = settings.threads;
    options.steps =
        input.dataset != nullptr ? kLadderSteps : 0;  // textures are fitted and measured in seconds
    options.measure = {.rate_seconds = 0};
    options.note = settings.note;

    FitInput part = input;
    std::optional<Dataset> sample;
    if (input.dataset != nullptr) {
      const DatasetInfo& info = input.dataset->info();
      const std::uint32_t width = std::min(info.width, kSampleSide),
                          height = std::min(info.height, kSampleSide);
      Result<Dataset> made = dataset_part(
          *input.dataset, views_apart ? pairs_of_views(info, kSampleViews) : spread_pairs(info, kSamplePairs),
          {(info.width - width) / 2, (info.height - height) / 2, width, height}, scratch_directory);
      if (!made) return made.error();
      sample.emplace(std::move(*made));
      part.dataset = &*sample;
      sample_pairs = std::max(sample_pairs, sample->info().pairs.size());
    }
    const Result<Reference> part_reference = Reference::of(part, scratch_directory);
    if (!part_reference) return part_reference.error();
    const Result<Trade> trade = run_trade(part, *part_reference, options);
    if (!trade) return trade.error();
    const Result<std::vector<SettingFamily>> found = families_of(*trade, input);
    if (!found) return found.error();
    families.insert(families.end(), found->begin(), found->end());
  }
  if (families.empty())
    return bad_argument("no measure says anything of this input: its texels are all alike");
  const Result<Reference> reference = Reference::of(input, scratch_directory);
  if (!reference) return reference.error();
  const double sampled = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  Result<AutomaticFit> out = Search(input, settings, target, *reference, std::move(families)).run();
  if (!out) return out.error();
  out->reasons["sample_seconds"] = sampled;
  if (sample_pairs > 0) out->reasons["sample_pairs"] = sample_pairs;
  return out;
}

}  // namespace btfc
