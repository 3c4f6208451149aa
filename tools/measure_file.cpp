// Loading a file once a setting, and comparing.
#include "tools/measure_file.h"

#include <algorithm>
#include <cmath>

#include "encoder/metrics/dataset_metrics.h"
#include "encoder/metrics/display_values.h"
#include "tools/dataset_part.h"
#include "tools/texture_dataset.h"

namespace btfc {
namespace {

constexpr std::size_t kMeasuredPairs = 1000, kLookedAtPairs = 64;
constexpr std::uint32_t kPictureSide = 128;
constexpr double kShownView = 0, kShownLight = 45;  // degrees from the normal

std::optional<double> if_finite(double v) { return std::isfinite(v) ? std::optional(v) : std::nullopt; }

TexelWindow whole_tile(const DatasetInfo& info) { return {0, 0, info.width, info.height}; }

// The pair nearest to the directions that show a surface best.
std::size_t shown_pair(const DatasetInfo& info) {
  const auto oddness = [&](const DirectionPair& p) {
    return std::abs(degrees(info.views[p.view].theta) - kShownView) +
           std::abs(degrees(info.lights[p.light].theta) - kShownLight);
  };
  const auto best = std::min_element(info.pairs.begin(), info.pairs.end(),
                                     [&](auto& a, auto& b) { return oddness(a) < oddness(b); });
  return static_cast<std::size_t>(best - info.pairs.begin());
}

// The middle as 8-bit RGB; the first channel where there are not three.
Image picture_of(const Image& image) {
  const std::vector<float> display = display_table(image.type, image.colour_space);
  Image out;
  out.width = std::min(image.width, kPictureSide);
  out.height = std::min(image.height, kPictureSide);
  out.channels = 3;
  const std::uint32_t left = (image.width - out.width) / 2, top = (image.height - out.height) / 2;
  for (std::uint32_t y = 0; y < out.height; ++y) {
    for (std::uint32_t x = 0; x < out.width; ++x) {
      for (std::uint32_t c = 0; c < 3; ++c) {
        const std::uint16_t code = image.at(left + x, top + y, image.channels >= 3 ? c : 0);
        out.codes.push_back(static_cast<std::uint16_t>(std::lround(255 * display[code])));
      }
    }
  }
  return out;
}

// Later levels each tell less and less.
std::vector<Knobs> knob_ladder(const btfc_file_info& info) {
  std::vector<Knobs> ladder = {{}};
  std::vector<std::uint32_t> levels;
  for (std::uint32_t l = 1; l < info.levels; l += l < 3 ? 1 : l < 9 ? 2 : l < 17 ? 4 : 8) levels.push_back(l);
  for (auto l = levels.rbegin(); l != levels.rend(); ++l) ladder.push_back({*l, 0, 0});
  for (const std::uint32_t gates : {16u, 4u, 1u}) {
    if (gates < info.gates) ladder.push_back({0, gates, 0});
  }
  for (const float culling : {1e-3f, 1e-2f}) {
    if (info.culls != 0) ladder.push_back({0, 0, culling});
  }
  return ladder;
}

// Where the last critical chunk of these levels ends.
std::uint64_t prefix_bytes(const Directory& directory, std::uint32_t levels) {
  if (levels == 0) return directory.header.file_bytes;
  std::uint64_t end = 0;
  for (const IndexEntry& e : directory.entries) {
    if ((e.key.flags & kCritical) != 0 && e.key.level < levels)
      end = std::max(end, e.offset + e.stored_bytes);
  }
  return end;
}

}  // namespace

double texture_distance_of(const TextureDistances& d) {
  return (d.marginals.ratio() + d.spectrum.ratio() + d.autocorrelation.ratio() + d.stsim2_ratio()) / 4;
}

Result<Reference> Reference::of(const FitInput& input, const std::string& scratch_directory) {
  Reference r;
  r.scratch_ = scratch_directory;
  if (input.dataset == nullptr) {
    r.image_.emplace(input.maps[0].image);
    return r;
  }
  const Dataset& all = *input.dataset;
  const auto part = [&](std::optional<Dataset>& to, const std::vector<std::size_t>& pairs) -> Result<Done> {
    Result<Dataset> made = dataset_part(all, pairs, whole_tile(all.info()), scratch_directory);
    if (!made) return made.error();
    to.emplace(std::move(*made));
    return Done{};
  };
  if (const auto ok = part(r.pairs_, spread_pairs(all.info(), kMeasuredPairs)); !ok) return ok.error();
  if (const auto ok = part(r.few_, spread_pairs(all.info(), kLookedAtPairs)); !ok) return ok.error();
  if (const auto ok = part(r.shown_, {shown_pair(all.info())}); !ok) return ok.error();
  return r;
}

Result<MeasuredError> Reference::measure(const Head& head, const btfc_texture* texture, bool keeps_texels,
                                         bool all) const {
  MeasuredError out;
  if (!btf()) {
    const Result<Image> decoded = decode_map(texture, 0);
    if (!decoded) return decoded.error();
    const Result<TextureDistances> distances = image_->distances(*decoded);
    if (!distances) return distances.error();
    out.texture_distance = if_finite(texture_distance_of(*distances));
    return out;
  }
  const auto compared = [&](const Dataset& against, const MetricOptions& options) -> Result<GroupMetrics> {
    const Result<Dataset> decoded = decode_dataset_like(head, texture, against.info(), scratch_);
    if (!decoded) return decoded.error();
    const Result<DatasetMetrics> m = compare_datasets(against, *decoded, {options, {}});
    if (!m) return m.error();
    return m->all;
  };
  // Lab is what distances of colours are reckoned in.
  const Result<GroupMetrics> most = compared(*pairs_, {false, all || !keeps_texels, false});
  if (!most) return most.error();
  out.brdf_rmse_8bit = if_finite(most->brdf_rmse_8bit);
  out.colour_distance = if_finite(most->colours);
  if (!keeps_texels) return out;
  out.psnr_db = std::min(most->psnr_db, kMostQualityPsnr);
  out.mae_lab = if_finite(most->mae_lab);
  if (!all) return out;
  const Result<GroupMetrics> few = compared(*few_, {true, false, true});
  if (!few) return few.error();
  out.ssim = if_finite(few->ssim);
  out.flip = if_finite(few->flip);
  return out;
}

Image Reference::picture() const { return picture_of(btf() ? shown_->image(0) : image_->image()); }

Result<Image> Reference::picture(const Head& head, const btfc_texture* texture) const {
  if (btf()) {
    const Result<Dataset> decoded = decode_dataset_like(head, texture, shown_->info(), scratch_);
    if (!decoded) return decoded.error();
    return picture_of(decoded->image(0));
  }
  const Result<Image> decoded = decode_map(texture, 0);
  if (!decoded) return decoded.error();
  return picture_of(*decoded);
}

std::optional<double> judged(const MeasuredError& e, bool keeps_texels) {
  if (keeps_texels) return e.psnr_db ? std::optional(-*e.psnr_db) : std::nullopt;
  if (e.texture_distance) return e.texture_distance;
  return e.colour_distance ? e.colour_distance : e.brdf_rmse_8bit;
}

const char* judged_by(const MeasuredError& e, bool keeps_texels) {
  if (keeps_texels) return "psnr_db";
  if (e.texture_distance) return "texture_distance";
  return e.colour_distance ? "colour_distance" : "brdf_rmse_8bit";
}

Result<std::vector<MeasuredSetting>> measure_settings(ByteView bytes, const Reference& reference,
                                                      const MeasureOptions& options) {
  const Result<OpenedFile> file = open_file(memory_source(&bytes));
  if (!file) return file.error();
  const bool keeps = fitter(file->head.model).keeps_texels;
  const Result<btfc_file_info> info = file_info(bytes);
  if (!info) return info.error();
  std::vector<MeasuredSetting> settings;
  for (const Knobs& knobs : knob_ladder(*info)) {
    const btfc_selection selection = selection_of(knobs);
    const Result<TexturePtr> texture = load_texture(bytes, &selection);
    if (!texture) return texture.error();
    MeasuredSetting m;
    m.knobs = knobs;
    m.payload_bytes = payload_bytes(file->layout, knobs.levels);
    m.file_bytes = prefix_bytes(file->directory, knobs.levels);
    Result<MeasuredError> e = reference.measure(file->head, texture->get(), keeps, options.slow);
    if (!e) return e.error();
    m.error = *e;
    m.cost = file->layout.prepared_cost;
    if (!m.cost) {
      const Result<std::optional<TexelCost>> cost = texel_cost(file->head, file->parm, knobs);
      if (!cost) return cost.error();
      m.cost = *cost;
    }
    if (options.rate_seconds > 0)
      m.rates = measure_rates(texture->get(), 0, {.seconds = options.rate_seconds, .reference = false});
    // Culling is the CPU's.
    if (options.shader && knobs.culling == 0) {
      Result<std::optional<DeviceRates>> rates =
          measure_shader_rates(texture->get(), 0, {.seconds = options.rate_seconds}, false);
      if (!rates) return rates.error();
      m.device = *std::move(rates);
    }
    if (options.pictures) {
      Result<Image> picture = reference.picture(file->head, texture->get());
      if (!picture) return picture.error();
      m.picture = *std::move(picture);
    }
    settings.push_back(std::move(m));
  }
  return settings;
}

Result<QualityCurve> curve_of(const std::vector<MeasuredSetting>& settings, const Reference& reference,
                              bool keeps_texels) {
  QualityCurve curve;
  curve.pairs = reference.measured_pairs();
  for (const MeasuredSetting& m : settings) {
    if (!judged(m.error, keeps_texels)) continue;
    QualityPoint p;
    p.knobs = m.knobs;
    const auto take = [&](std::uint32_t measure, const std::optional<double>& from, float& to) {
      if (!from) return;
      curve.measures |= measure;
      to = static_cast<float>(*from);
    };
    take(kQualityPsnr, m.error.psnr_db, p.psnr_db);
    take(kQualityLab, m.error.mae_lab, p.mae_lab);
    if (!keeps_texels) take(kQualityDistance, judged(m.error, false), p.distance);
    if (m.rates.full > 0) take(kQualityRate, m.rates.full / m.rates.lookup, p.rate);
    if (m.cost) {
      const auto number = [](std::uint64_t n) {
        return static_cast<std::uint32_t>(std::min<std::uint64_t>(n, UINT32_MAX));
      };
      curve.measures |= kQualityCost;
      p.operations = number(m.cost->operations);
      p.reads = number(m.cost->reads);
    }
    curve.points.push_back(p);
  }
  if (curve.points.empty())
    return Error{Status::failed, "no measure says anything of this input: its texels are all alike", "", 0};
  return curve;
}

}  // namespace btfc
