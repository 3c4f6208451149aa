// Queries, threads and the processor's modes.
#include "tests/extremes/extreme_decode.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <thread>

#include "encoder/split_mix.h"

#ifdef __SSE__
#include <xmmintrin.h>
#endif

namespace btfc::test {
namespace {

// While one lives, its thread's denormal results and operands are 0.
class FlushToZero {
 public:
  explicit FlushToZero(bool on) {
#ifdef __SSE__
    before_ = _mm_getcsr();
    constexpr unsigned kFlush = 0x8000, kDenormalsAreZero = 0x0040;
    if (on) _mm_setcsr(before_ | kFlush | kDenormalsAreZero);
#else
    static_cast<void>(on);
#endif
  }
  ~FlushToZero() {
#ifdef __SSE__
    _mm_setcsr(before_);
#endif
  }
  FlushToZero(const FlushToZero&) = delete;
  FlushToZero& operator=(const FlushToZero&) = delete;

 private:
  [[maybe_unused]] unsigned before_ = 0;
};

constexpr btfc_directions kLooks[] = {{{0, 0, 1}, {0, 0, 1}, 1, 0},
                                      {{0.3f, 0.2f, 0.7f}, {-0.4f, 0.5f, 0.3f}, 1, 0}};

void measured(const btfc_texture* texture, SplitMix64& random, btfc_query& q) {
  if (btfc_texture_views(texture) == 0) return;
  btfc_texture_view(texture, static_cast<std::uint32_t>(random.below(btfc_texture_views(texture))), q.view);
  btfc_texture_light(texture, static_cast<std::uint32_t>(random.below(btfc_texture_lights(texture))),
                     q.light);
}

void towards(SplitMix64& random, double z, float (&d)[3]) {
  const double phi = 6.283185307179586 * random.uniform(), r = std::sqrt(std::max(0.0, 1 - z * z));
  d[0] = static_cast<float>(r * std::cos(phi));
  d[1] = static_cast<float>(r * std::sin(phi));
  d[2] = static_cast<float>(z);
}

// No direction that one could look along; the odd ones of numbers that are finite.
void nothing(SplitMix64& random, bool odd, float (&d)[3]) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kOdd[] = {
      0.0f, std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, 3e38f, -3e38f, 1e-45f};
  for (float& c : d) {
    do {
      c = kOdd[random.below(std::size(kOdd))];
    } while (odd && !std::isfinite(c));
  }
}

struct Map {
  std::uint32_t width, height, channels;
};
Map map_of(const btfc_texture* texture, std::uint32_t map) {
  btfc_map_info info{};
  btfc_texture_map_info(texture, map, &info);
  return {btfc_texture_width(texture), btfc_texture_height(texture), info.channels};
}

void answer(const btfc_texture* texture, const btfc_query& query, float* values) {
  btfc_eval(texture, nullptr, &query, sizeof query, 1, values, 4);
}

// Rows of a map under one look. Of unbounded textures the whole map at once: a call makes its tiles anew.
struct Band {
  std::uint32_t map, y, rows;
  std::size_t look, first, count;
};
std::vector<Band> bands_of(const btfc_texture* texture) {
  std::vector<Band> bands;
  const bool whole = btfc_texture_unbounded(texture) != 0;
  std::size_t first = 0;
  for (std::uint32_t map = 0; map < btfc_texture_maps(texture); ++map) {
    const Map m = map_of(texture, map);
    const std::uint32_t rows = whole ? m.height : 1;
    for (std::size_t look = 0; look < (whole ? 1 : std::size(kLooks)); ++look) {
      for (std::uint32_t y = 0; y < m.height; y += rows) {
        bands.push_back({map, y, rows, look, first, std::size_t{m.width} * m.channels * rows});
        first += bands.back().count;
      }
    }
  }
  return bands;
}

void decode_band(const btfc_texture* texture, const Band& band, float* values) {
  const std::uint32_t width = btfc_texture_width(texture);
  btfc_decode_rect(texture, nullptr, band.map, &kLooks[band.look], 0, static_cast<std::int32_t>(band.y),
                   width, band.rows, BTFC_FLOAT32, values, band.count / band.rows * sizeof(float),
                   band.count * sizeof(float));
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

}  // namespace

bool Answers::operator==(const Answers& other) const {
  return same_bits(values, other.values) && same_bits(batch, other.batch) && same_bits(whole, other.whole);
}

std::vector<Query> queries_of(const btfc_texture* texture, std::size_t each) {
  SplitMix64 random(3);
  std::vector<Query> queries;
  const std::uint32_t width = btfc_texture_width(texture), height = btfc_texture_height(texture);
  for (std::size_t i = 0; i < each * std::size(kQueryKinds); ++i) {
    Query q{i % std::size(kQueryKinds), {}};
    q.query.x = static_cast<std::int32_t>(random.below(width));
    q.query.y = static_cast<std::int32_t>(random.below(height));
    q.query.map = static_cast<std::uint32_t>(i / std::size(kQueryKinds)) % btfc_texture_maps(texture);
    measured(texture, random, q.query);
    if (q.kind == 1) {
      towards(random, 0.1 * random.uniform(), q.query.view);
      towards(random, i % 2 == 0 ? 0 : 0.01 * random.uniform(), q.query.light);
    }
    if (q.kind == 2) {
      towards(random, random.uniform(), q.query.view);
      towards(random, -random.uniform(), q.query.light);
    }
    if (q.kind == 3) {
      nothing(random, i % 2 == 1, q.query.view);
      nothing(random, i % 2 == 1, q.query.light);
    }
    if (q.kind == 4) {
      constexpr std::int32_t kEnds[] = {INT32_MIN, INT32_MIN + 1, INT32_MAX, INT32_MAX - 1, -1, 1 << 24};
      q.query.x = kEnds[random.below(std::size(kEnds))];
      q.query.y = kEnds[random.below(std::size(kEnds))];
    }
    queries.push_back(q);
  }
  return queries;
}

Asked ask(const Bytes& file, const std::vector<Query>& queries, bool flush_to_zero) {
  Asked asked;
  std::thread([&] {
    const FlushToZero mode(flush_to_zero);
    btfc_error error{};
    const TexturePtr texture = load(file, &error);
    if (!texture) {
      asked.refusal = error.message;
      return;
    }
    asked.answers = ask_on_threads(texture.get(), queries, 1);
  }).join();
  return asked;
}

Answers ask_on_threads(const btfc_texture* texture, const std::vector<Query>& queries, std::size_t threads) {
  Answers out;
  out.values.assign(4 * queries.size(), 0.0f);
  const std::vector<Band> bands = bands_of(texture);
  out.whole.assign(bands.empty() ? 0 : bands.back().first + bands.back().count, 0.0f);
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i; (i = next++) < queries.size() + bands.size();) {
      if (i < queries.size()) {
        answer(texture, queries[i].query, &out.values[4 * i]);
      } else {
        const Band& band = bands[i - queries.size()];
        decode_band(texture, band, &out.whole[band.first]);
      }
    }
  };
  const auto together = [&] {
    // So many in a call are answered in another way than one.
    constexpr std::size_t kMany = 256;
    if (queries.empty() || btfc_texture_unbounded(texture)) return;
    std::vector<btfc_query> many;
    while (many.size() < kMany) many.push_back(queries[many.size() % queries.size()].query);
    out.batch.assign(4 * many.size(), 0.0f);
    btfc_eval(texture, nullptr, many.data(), sizeof(btfc_query), many.size(), out.batch.data(), 4);
  };
  if (threads == 1) {  // in the caller's mode
    work();
    together();
    return out;
  }
  std::vector<std::thread> all;
  for (std::size_t t = 0; t < threads; ++t) all.emplace_back(work);
  all.emplace_back(together);
  for (std::thread& t : all) t.join();
  return out;
}

}  // namespace btfc::test
