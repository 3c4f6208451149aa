// The plain recursion.
#include "format/models/field_band.h"

#include <algorithm>

namespace btfc {

FieldBand field_band(const FieldShape& shape, std::uint32_t level, const float* numbers) {
  FieldBand band;
  band.kind = shape.kind;
  band.factors = shape.factors;
  band.level = level;
  band.margin = shape.margins[level];
  band.seed = shape.seed;
  for (std::uint32_t f = 0; f < shape.masks_per_level(); ++f) {
    std::vector<FieldOffset> offsets;
    for (std::uint32_t i = 0; i < kFieldCandidates; ++i) {
      if ((shape.mask(level, f) >> i & 1) != 0) offsets.push_back(field_offset(i));
    }
    band.offsets.push_back(std::move(offsets));
  }
  for (std::uint32_t f = 0; f < shape.factors; ++f) band.begins.push_back(shape.factor_begin(level, f));
  band.record = shape.level_numbers(level);
  band.numbers = numbers;
  return band;
}

std::vector<std::uint32_t> field_places(std::int64_t first, std::size_t count, std::uint32_t level,
                                        std::uint32_t period) {
  const std::int64_t size = period != 0 ? std::int64_t{period >> level} : std::int64_t{1} << (32 - level);
  std::vector<std::uint32_t> places(count);
  std::int64_t at = first % size;
  if (at < 0) at += size;
  for (std::uint32_t& place : places) {
    place = static_cast<std::uint32_t>(at);
    if (++at == size) at = 0;
  }
  return places;
}

template <class Real>
void field_synthesise_plain(const FieldBand& band, std::uint32_t subspace, const FieldWindow& window,
                            Real* out) {
  const auto m = static_cast<std::ptrdiff_t>(band.margin);
  const std::ptrdiff_t width = static_cast<std::ptrdiff_t>(window.width) + 2 * m;
  const std::ptrdiff_t height = static_cast<std::ptrdiff_t>(window.height) + m;
  const std::size_t d = band.factors;
  const auto xs = field_places(window.x - m, static_cast<std::size_t>(width), band.level, band.period);
  const auto ys = field_places(window.y - m, static_cast<std::size_t>(height), band.level, band.period);
  const float* record = band.numbers + std::size_t{subspace} * band.record;
  const std::size_t plane = static_cast<std::size_t>(width * height);
  std::vector<Real> values(d * plane);
  const auto value = [&](std::size_t f, std::ptrdiff_t x, std::ptrdiff_t y) {
    if (x < 0 || x >= width || y < 0) return Real(0);
    return values[f * plane + static_cast<std::size_t>(y * width + x)];
  };
  for (std::ptrdiff_t y = 0; y < height; ++y) {
    for (std::ptrdiff_t x = 0; x < width; ++x) {
      const auto noise = [&](std::size_t f) {
        const uint stream = field_stream(band.seed, band.level, static_cast<uint>(f));
        return Real(static_cast<float>(field_noise_integer(xs[static_cast<std::size_t>(x)],
                                                           ys[static_cast<std::size_t>(y)], stream)) *
                    FIELD_NOISE_UNIT);
      };
      for (std::size_t f = 0; f < d; ++f) {
        Real parts[4] = {0, 0, 0, 0};
        std::size_t term = 0;
        const auto& offsets = band.neighbours(static_cast<std::uint32_t>(f));
        if (band.coupled()) {
          const float* factor = record + f * (f + 1) / 2;
          for (std::size_t g = 0; g <= f; ++g) parts[0] += Real(factor[g]) * noise(g);
          const float* a = record + d * (d + 1) / 2;
          for (std::size_t s = 0; s < offsets.size(); ++s) {
            for (std::size_t g = 0; g < d; ++g)
              parts[term++ % 4] +=
                  Real(a[(s * d + f) * d + g]) * value(g, x + offsets[s].dx, y + offsets[s].dy);
          }
        } else {
          const float* numbers = record + band.begins[f];
          parts[0] = Real(numbers[0]) * noise(f);
          for (std::size_t s = 0; s < offsets.size(); ++s)
            parts[term++ % 4] += Real(numbers[1 + s]) * value(f, x + offsets[s].dx, y + offsets[s].dy);
        }
        values[f * plane + static_cast<std::size_t>(y * width + x)] =
            (parts[0] + parts[1]) + (parts[2] + parts[3]);
      }
    }
  }
  for (std::size_t f = 0; f < d; ++f) {
    for (std::uint32_t y = 0; y < window.height; ++y) {
      const Real* row = values.data() + f * plane + static_cast<std::size_t>((y + m) * width + m);
      std::copy_n(row, window.width, out + (f * window.height + y) * window.width);
    }
  }
}

template void field_synthesise_plain<float>(const FieldBand&, std::uint32_t, const FieldWindow&, float*);
template void field_synthesise_plain<double>(const FieldBand&, std::uint32_t, const FieldWindow&, double*);

}  // namespace btfc
