// .ptm <-> chunks of model ptm.
#include "encoder/models/ptm_exchange.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "encoder/input/ptm_file.h"
#include "encoder/output/atomic_file.h"
#include "format/models/ptm_payload.h"

namespace btfc {
namespace {

constexpr double kWhite = 255;  // a .ptm file's values run to 255, ours to 1

// A scale as the file's step: what the exporter below finds its way back from.
float step_of(double scale) { return static_cast<float>(scale / kWhite); }

// The shortest decimal number whose step is this one.
double scale_of(float step) {
  const double exact = static_cast<double>(step) * kWhite;
  for (int digits = 1; digits < 17; ++digits) {
    const std::string text = fmt::format("{:.{}e}", exact, digits - 1);
    double scale = 0;
    std::from_chars(text.data(), text.data() + text.size(), scale);
    if (step_of(scale) == step) return scale;
  }
  return exact;
}

// Where a level keeps term order[i]: its row of channel 0, over the channels.
struct TermPlace {
  std::uint32_t level, row;
};
TermPlace place_of(std::uint32_t i) {
  std::uint32_t level = 0;
  while (i >= kPtmFirstTerm[level + 1]) ++level;
  return {level, i - kPtmFirstTerm[level]};
}

Head head_of(const PtmFile& file) {
  Head head;
  head.model = ModelId::ptm;
  head.width = file.width;
  head.height = file.height;
  head.quantity = Quantity::reflectance_cos;
  Map map;
  map.colour_space = ColourSpace::unknown;
  head.maps = {map};
  return head;
}

// An RGB file's bytes as they are: value = scale / 255 (byte - bias).
PtmView view_of_bytes(const PtmFile& file) {
  const std::size_t texels = file.texels();
  PtmView view;
  for (std::uint32_t i = 0; i < kPtmTerms; ++i) {
    const std::uint32_t k = kPtmTermOrder[i];
    CodedRows& rows = view[place_of(i).level];
    const float step = step_of(file.scale[k]);
    for (std::size_t c = 0; c < 3; ++c) {
      ++rows.rows;
      rows.scales.push_back({-static_cast<float>(file.bias[k]) * step, step});
      for (std::size_t t = 0; t < texels; ++t)
        rows.elements.push_back(file.coefficients[(c * texels + t) * kPtmTerms + k]);
    }
    rows.precision = Precision::u8;
    rows.columns = texels;
  }
  return view;
}

PtmView view_of_values(const PtmFile& file, Precision precision) {
  const std::size_t texels = file.texels();
  std::array<std::vector<float>, kPtmLevels> values;
  for (std::uint32_t i = 0; i < kPtmTerms; ++i) {
    const std::uint32_t k = kPtmTermOrder[i];
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t t = 0; t < texels; ++t) {
        const bool rgb = file.form == PtmForm::rgb;
        const double byte = file.coefficients[((rgb ? c * texels : 0) + t) * kPtmTerms + k];
        const double colour = rgb ? 1 : file.colours[t * 3 + c] / kWhite;
        values[place_of(i).level].push_back(
            static_cast<float>(file.scale[k] * (byte - file.bias[k]) * colour / kWhite));
      }
    }
  }
  PtmView view;
  for (std::uint32_t level = 0; level < kPtmLevels; ++level)
    view[level] = code_rows(values[level], values[level].size() / texels, texels, precision);
  return view;
}

// The bias of rows that came out of a .ptm file: one step and offset for all channels, the offset a whole
// number of steps.
std::optional<std::int32_t> shared_bias(std::span<const RowScale> scales) {
  const RowScale& s = scales[0];
  if (!(s.step > 0)) return std::nullopt;
  const double bias = std::round(-static_cast<double>(s.offset) / s.step);
  for (const RowScale& other : scales) {
    if (other.step != s.step || other.offset != s.offset) return std::nullopt;
  }
  if (std::fabs(bias) > 1e6 || -static_cast<float>(bias) * s.step != s.offset) return std::nullopt;
  return static_cast<std::int32_t>(bias);
}

// Term i of all channels, which begin at row `first`: into the file's term k.
void export_term(const CodedRows& rows, std::uint64_t first, std::uint32_t channels, std::uint32_t k,
                 PtmFile& file) {
  const std::size_t texels = file.texels();
  const auto scales = std::span(rows.scales).subspan(first, channels);
  const auto row_of = [&](std::size_t c) { return first + (channels == 1 ? 0 : c); };
  const auto put = [&](std::size_t c, std::size_t t, std::uint32_t byte) {
    file.coefficients[(c * texels + t) * kPtmTerms + k] = static_cast<std::uint8_t>(byte);
  };
  const auto bias = rows.precision == Precision::u8 ? shared_bias(scales) : std::nullopt;
  if (bias) {
    file.scale[k] = scale_of(scales[0].step);
    file.bias[k] = *bias;
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t t = 0; t < texels; ++t) put(c, t, rows.elements[row_of(c) * texels + t]);
    }
    return;
  }
  // 0 is within the range, so that the bias is one of 0 … 255, which is all that some readers take; and a
  // rounded bias moves the range by half a step at most, for which one of the 255 steps is left.
  double least = 0, most = 0;
  for (std::uint32_t c = 0; c < channels; ++c) {
    for (std::size_t t = 0; t < texels; ++t) {
      const double value = rows.value(first + c, t);
      least = std::min(least, value);
      most = std::max(most, value);
    }
  }
  const double range = (most - least) * kWhite / 254;
  // A millionth more: the text is the shortest one, and bytes beyond 255 would be cut off.
  const auto step = most > least ? static_cast<float>(range / kWhite * (1 + 1e-6)) : 1.0f;
  file.scale[k] = scale_of(step);
  file.bias[k] = static_cast<std::int32_t>(std::lround(-least / step));
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t t = 0; t < texels; ++t) {
      const long byte = std::lround(rows.value(row_of(c), t) / step) + file.bias[k];
      put(c, t, static_cast<std::uint32_t>(std::clamp(byte, 0L, 255L)));
    }
  }
}

}  // namespace

Result<FitResult> ptm_import(const std::string& path, const FitSettings& settings) {
  const Result<Bytes> bytes = read_file(path);
  if (!bytes) return bytes.error();
  const Result<PtmFile> file = parse_ptm_file(path, *bytes);
  if (!file) return file.error();
  const bool rgb = file->form == PtmForm::rgb;
  const auto precision = parse_precision(settings.options, "precision", rgb ? Precision::u8 : Precision::f32);
  if (!precision) return precision.error();
  const Head head = head_of(*file);
  const PtmShape shape{*precision};
  if (const auto fits = read_ptm_parm(head, write_ptm_parm(shape)); !fits) return fits.error();
  PtmPayload payload;
  payload.directions = {{{0, 0}}, {{0, 0}}, {{0, 0}}};
  // A scale below 0 has no place in a file of ours, whose steps are not below 0.
  const bool bytes_fit = std::all_of(file->scale.begin(), file->scale.end(), [](double s) { return s >= 0; });
  payload.views.push_back(rgb && bytes_fit && *precision == Precision::u8
                              ? view_of_bytes(*file)
                              : view_of_values(*file, *precision));
  FitResult result;
  result.chunks = ptm_write(head, shape, payload);
  result.report = {{"form", rgb ? "rgb" : "lrgb", false}};
  return result;
}

Result<Bytes> ptm_export(const Head& head, ByteView parm, const ChunkReader& read) {
  const Result<PtmShape> shape = read_ptm_parm(head, parm);
  if (!shape) return shape.error();
  const std::uint32_t channels = head.channels();
  if (head.views != 1 || head.maps.size() != 1 || (channels != 1 && channels != 3)) {
    return bad_argument(
        fmt::format("a .ptm file holds one view and 1 or 3 channels, this file has {} views, {} maps and {} "
                    "channels",
                    head.views, head.maps.size(), channels));
  }
  const Result<PtmView> view = read_ptm_view(head, *shape, read, 0, kPtmLevels);
  if (!view) return view.error();
  PtmFile file;
  file.width = head.width;
  file.height = head.height;
  file.coefficients.resize(file.texels() * 3 * kPtmTerms);
  for (std::uint32_t i = 0; i < kPtmTerms; ++i) {
    const TermPlace place = place_of(i);
    export_term((*view)[place.level], std::uint64_t{place.row} * channels, channels, kPtmTermOrder[i], file);
  }
  return write_ptm_file(file);
}

}  // namespace btfc
