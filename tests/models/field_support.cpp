// Recipes -> chunks -> files.
#include "tests/models/field_support.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include "tests/btf_support.h"

namespace btfc::test {
namespace {

// Numbers of both signs whose sizes add up to `whole`.
std::vector<float> coefficients(SplitMix64& random, std::size_t count, double whole) {
  std::vector<double> raw(count);
  double sum = 0;
  for (double& v : raw) {
    v = 0.2 + random.uniform();
    if (random.below(3) == 0) v = -v;
    sum += std::fabs(v);
  }
  std::vector<float> out;
  for (const double v : raw) out.push_back(static_cast<float>(whole * v / sum));
  return out;
}

// Householder's reflection of a random vector: orthonormal.
std::vector<float> orthonormal(SplitMix64& random, std::size_t d) {
  std::vector<double> v(d);
  double length = 0;
  for (double& x : v) {
    x = random.uniform() - 0.4;
    length += x * x;
  }
  std::vector<float> out;
  for (std::size_t i = 0; i < d; ++i) {
    for (std::size_t j = 0; j < d; ++j)
      out.push_back(static_cast<float>((i == j ? 1.0 : 0.0) - 2 * v[i] * v[j] / length));
  }
  return out;
}

}  // namespace

std::size_t MadeField::basis_at(std::size_t subspace) const {
  return subspace * shape.record_numbers() + shape.factors;
}
std::size_t MadeField::signature_at(std::size_t subspace) const {
  return basis_at(subspace) + (shape.coupled() ? 0 : std::size_t{shape.factors} * shape.factors);
}
std::size_t MadeField::factor_at(std::size_t subspace, std::size_t factor) const {
  return signature_at(subspace) + 4 + factor * (shape.levels + shape.knots);
}

std::uint64_t random_mask(SplitMix64& random, std::uint32_t count) {
  std::uint64_t mask = 0;
  while (static_cast<std::uint32_t>(__builtin_popcountll(mask)) < count)
    mask |= std::uint64_t{1} << random.below(kFieldCandidates);
  return mask;
}

FieldRecipe rich_recipe(ModelId model) {
  FieldRecipe recipe;
  recipe.model = model;
  recipe.channels = {3, 1};
  recipe.rings = 2;
  recipe.clusters = 5;
  recipe.knots = 5;
  return recipe;
}

MadeField make_field(const FieldRecipe& r) {
  MadeField made;
  SplitMix64 random(r.seed * 7919 + 3);
  Head& head = made.head;
  head.model = r.model;
  head.width = r.width;
  head.height = r.height;
  head.unbounded = true;
  for (std::size_t m = 0; m < r.channels.size(); ++m) {
    Map map;
    map.name = fmt::format("map{}", m);
    map.channels = r.channels[m];
    head.maps.push_back(map);
  }
  Directions& directions = made.payload.directions;
  if (r.rings == 0) {
    directions = {{DirectionPoint{}}, {DirectionPoint{}}, {{0, 0}}};
  } else {
    for (const Direction& d : rings(static_cast<int>(r.rings)))
      directions.views.push_back(point_of(d.theta, d.phi));
    directions.lights = directions.views;
    directions.pairs = all_pairs(directions.views.size(), directions.lights.size());
  }
  head.views = static_cast<std::uint32_t>(directions.views.size());
  head.lights = static_cast<std::uint32_t>(directions.lights.size());
  head.pairs = static_cast<std::uint32_t>(directions.pairs.size());

  FieldShape& s = made.shape;
  s.kind = field_kind(r.model);
  s.factors = head.channels();
  s.clusters = r.clusters;
  s.levels = r.levels;
  s.precision = Precision::f32;
  s.knots = r.knots;
  s.seed = r.seed;
  if (s.kind == FieldKind::gmrf) {
    s.torus_log2 = r.torus_log2;
  } else {
    std::fill_n(s.margins.begin(), s.levels, r.margin);
  }
  if (r.range_width > 0) {
    s.range_bits = 16;
    s.range_width = r.range_width;
    s.range_height = r.range_height;
  }
  s.masks.assign(std::size_t{s.levels} * s.masks_per_level(), nearest_candidates(r.order));
  const double left = std::pow(r.whole, r.margin) / (1 - r.whole);
  s.error = static_cast<float>(2 * 5.949 * r.spread * s.levels * s.factors * left + 4e-6);
  if (s.kind == FieldKind::gmrf) s.error = 4e-6f;

  FieldPayload& p = made.payload;
  for (std::uint32_t pair = 0; pair < head.pairs; ++pair)
    p.subspace_of_pair.push_back(
        static_cast<std::uint16_t>(pair < s.clusters ? pair : random.below(s.clusters)));
  p.range.assign(std::size_t{s.range_width} * s.range_height, 0);
  for (std::uint32_t k = 0; k < s.clusters; ++k) {
    for (std::uint32_t c = 0; c < s.factors; ++c)
      p.records.push_back(static_cast<float>(0.3 + 0.4 * random.uniform()));
    if (!s.coupled()) {
      const std::vector<float> basis = orthonormal(random, s.factors);
      p.records.insert(p.records.end(), basis.begin(), basis.end());
    }
    p.records.insert(p.records.end(), {0.0f, 0.0f, 0.0f, 1.0f});
    for (std::uint32_t f = 0; f < s.factors; ++f) {
      p.records.push_back(1.0f);
      for (std::uint32_t l = 1; l < s.levels; ++l) p.records.push_back(0.1f * static_cast<float>(l));
      for (std::uint32_t i = 0; i < s.knots; ++i)
        p.records.push_back(FIELD_TABLE_END *
                            (2 * static_cast<float>(i) / static_cast<float>(s.knots - 1) - 1));
    }
  }
  for (std::uint32_t l = 0; l < s.levels; ++l) {
    std::vector<float> numbers;
    for (std::uint32_t k = 0; k < s.clusters; ++k) {
      if (s.coupled()) {
        const std::size_t d = s.factors, n = s.neighbours(l, 0);
        for (std::size_t i = 0; i < d; ++i) {
          for (std::size_t j = 0; j <= i; ++j)
            numbers.push_back(static_cast<float>(
                r.spread * (i == j ? 0.9 : 0.3 * random.uniform() / static_cast<double>(d))));
        }
        // Each output's coefficients, and each source's, add up to `whole` at most.
        std::vector<float> a(n * d * d);
        for (std::size_t f = 0; f < d; ++f) {
          const std::vector<float> own = coefficients(random, n, r.whole);
          for (std::size_t i = 0; i < n; ++i) {
            a[(i * d + f) * d + f] = 0.7f * own[i];
            if (d > 1) a[(i * d + f) * d + (f + 1) % d] = 0.3f * own[i];
          }
        }
        numbers.insert(numbers.end(), a.begin(), a.end());
        continue;
      }
      for (std::uint32_t f = 0; f < s.factors; ++f) {
        numbers.push_back(static_cast<float>(r.spread * (0.5 + 0.5 * random.uniform())));
        const std::vector<float> own = coefficients(random, s.neighbours(l, f), r.whole);
        numbers.insert(numbers.end(), own.begin(), own.end());
      }
    }
    p.levels.push_back(std::move(numbers));
  }
  return made;
}

Bytes file_of(const MadeField& field) {
  const Result<Bytes> file = pack_file(field_write(field.head, field.shape, field.payload));
  if (!file) {
    ADD_FAILURE() << file.error().message;
    return {};
  }
  const Result<Done> good = verify_bytes(*file);
  EXPECT_TRUE(good) << good.error().message;
  return *file;
}

LoadedField loaded(const Bytes& file) {
  LoadedField out{};
  const Result<OpenedFile> opened = open_bytes(file);
  if (!opened) {
    ADD_FAILURE() << opened.error().message;
    return out;
  }
  const ByteView view(file);
  Result<LoadedItem> item = load_item(source_of(view), *opened);
  if (!item) {
    ADD_FAILURE() << item.error().message;
    return out;
  }
  out.item = *std::move(item);
  std::memcpy(&out.p, out.item.map_params[0].data(), sizeof out.p);
  return out;
}

TexturePtr load_part(const Bytes& file, const btfc_selection& selection, btfc_error* error) {
  btfc_reader* reader = nullptr;
  if (btfc_reader_open_memory(file.data(), file.size(), nullptr, &reader, error) != BTFC_OK) return nullptr;
  const std::unique_ptr<btfc_reader, ReaderFree> owned(reader);
  btfc_texture* texture = nullptr;
  if (btfc_texture_load(reader, &selection, &texture, error) != BTFC_OK) return nullptr;
  return TexturePtr(texture);
}

std::vector<float> answers(const btfc_texture* texture, btfc_scratch* scratch,
                           std::span<const btfc_query> queries) {
  std::vector<float> values(4 * queries.size());
  EXPECT_EQ(btfc_eval(texture, scratch, queries.data(), sizeof(btfc_query), queries.size(), values.data(), 4),
            BTFC_OK);
  const auto odd = std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  EXPECT_EQ(odd, values.end()) << "query " << (odd - values.begin()) / 4;
  return values;
}

std::vector<float> rectangle(const btfc_texture* texture, btfc_scratch* scratch,
                             const btfc_directions& directions, std::int32_t x, std::int32_t y,
                             std::uint32_t width, std::uint32_t height, std::uint32_t map) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, map, &info);
  std::vector<float> values(std::size_t{width} * height * info.channels);
  EXPECT_EQ(
      btfc_decode_rect(texture, scratch, map, &directions, x, y, width, height, BTFC_FLOAT32, values.data(),
                       width * info.channels * sizeof(float), values.size() * sizeof(float)),
      BTFC_OK);
  const auto odd = std::find_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); });
  EXPECT_EQ(odd, values.end()) << "value " << odd - values.begin();
  return values;
}

double worst_difference(std::span<const float> a, std::span<const float> b) {
  EXPECT_EQ(a.size(), b.size());
  double worst = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    worst = std::max(worst, std::fabs(double{a[i]} - double{b[i]}));
  return worst;
}

double mean_of(std::span<const float> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace btfc::test
