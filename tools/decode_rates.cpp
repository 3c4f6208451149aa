// How fast a texture is decoded: contestants that take turns.
#include "tools/decode_rates.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <random>
#include <thread>
#include <vector>

namespace btfc {
namespace {

constexpr std::size_t kRandomTexels = 100000;
constexpr std::size_t kSingleQueries = 4000;  // of a BTF, one a call: some models take microseconds for one

// Median over rounds of texels per second; work() handles `texels` of them.
struct Contestant {
  double DecodeRates::*result;
  std::size_t texels;
  std::function<void()> work;
  std::vector<double> rates;
};

// Contestants take turns, so that a disturbance of the machine meets all of them.
void measure(std::vector<Contestant>& all, double seconds) {
  using Clock = std::chrono::steady_clock;
  constexpr int kRounds = 7;
  for (int round = 0; round < kRounds; ++round) {
    for (Contestant& one : all) {
      std::size_t runs = 0;
      const auto begin = Clock::now();
      double spent = 0;
      do {
        one.work();
        ++runs;
        spent = std::chrono::duration<double>(Clock::now() - begin).count();
      } while (spent < seconds / kRounds);
      one.rates.push_back(static_cast<double>(runs * one.texels) / spent);
    }
  }
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// The whole map on some threads, rows shared out, each with a cache of its own.
void decode_whole(const btfc_texture* t, std::uint32_t map, const btfc_directions& directions,
                  btfc_sample sample, std::size_t row, unsigned threads, unsigned char* out) {
  const std::uint32_t width = btfc_texture_width(t), height = btfc_texture_height(t);
  const auto work = [&](std::uint32_t first, std::uint32_t end) {
    using ScratchPtr = std::unique_ptr<btfc_scratch, decltype(&btfc_scratch_free)>;
    const ScratchPtr scratch(btfc_texture_unbounded(t) != 0 ? btfc_scratch_new(t) : nullptr,
                             btfc_scratch_free);
    btfc_decode_rect(t, scratch.get(), map, &directions, 0, static_cast<std::int32_t>(first), width,
                     end - first, sample, out + first * row, row, (end - first) * row);
  };
  std::vector<std::thread> others;
  for (unsigned i = 1; i < threads; ++i)
    others.emplace_back(work, height * i / threads, height * (i + 1) / threads);
  work(0, height / threads);
  for (std::thread& other : others) other.join();
}

// Of a BTF, a pair that was not measured.
btfc_directions oblique(float footprint) { return {{0.35f, 0.2f, 0.8f}, {-0.3f, 0.45f, 0.7f}, footprint, 0}; }

}  // namespace

DecodeRates measure_rates(const btfc_texture* t, std::uint32_t map, const RateOptions& options) {
  btfc_map_info info{};
  btfc_texture_map_info(t, map, &info);
  const std::uint32_t width = btfc_texture_width(t), height = btfc_texture_height(t);
  const std::size_t texel_bytes = info.channels * (info.sample == BTFC_UNORM8 ? 1u : 2u);
  const std::size_t row = width * texel_bytes, size = row * height, texels = std::size_t{width} * height;

  std::mt19937 random(1);
  std::vector<std::int32_t> at(2 * kRandomTexels);
  for (std::size_t i = 0; i < kRandomTexels; ++i) {
    at[2 * i] = static_cast<std::int32_t>(random() % width);
    at[2 * i + 1] = static_cast<std::int32_t>(random() % height);
  }
  // Of a BTF: rectangles under a pair of directions that was not measured, queries under any.
  const bool btf = btfc_texture_views(t) > 1 || btfc_texture_lights(t) > 1;
  const btfc_directions fixed = oblique(options.footprint);
  // Footprints are answered one query at a time.
  const std::size_t batch_texels = btf && options.footprint > 1 ? kSingleQueries : kRandomTexels;
  std::vector<btfc_query> queries(btf ? batch_texels : 0);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    btfc_query& q = queries[i];
    q.x = at[2 * i];
    q.y = at[2 * i + 1];
    q.map = map;
    q.footprint = options.footprint;
    for (float(*d)[3] : {&q.view, &q.light}) {
      const double z = static_cast<double>(random()) * 0x1p-32,
                   phi = static_cast<double>(random()) * 0x1p-32 * 6.2831853;
      const double r = std::sqrt(1 - z * z);
      (*d)[0] = static_cast<float>(r * std::cos(phi));
      (*d)[1] = static_cast<float>(r * std::sin(phi));
      (*d)[2] = static_cast<float>(z);
    }
  }
  // Unbounded textures: rectangles anew each time, texels through what a thread keeps, and the reference,
  // which keeps nothing, for a few texels only.
  const bool unbounded = btfc_texture_unbounded(t) != 0;
  using ScratchPtr = std::unique_ptr<btfc_scratch, decltype(&btfc_scratch_free)>;
  const ScratchPtr scratch(unbounded ? btfc_scratch_new(t) : nullptr, btfc_scratch_free);
  std::vector<float> values(4 * queries.size());
  std::vector<unsigned char> image(size), other(size), batch(kRandomTexels * texel_bytes);
  btfc_decode_rect(t, nullptr, map, &fixed, 0, 0, width, height, info.sample, image.data(), row, size);

  const std::uint32_t naive_rows = std::min(height, unbounded ? 1u : btf ? 8u : 64u);
  const std::uint32_t naive_columns = unbounded ? std::min(width, 16u) : width;
  std::vector<Contestant> all = {
      {&DecodeRates::full,
       texels,
       [&] {
         decode_whole(t, map, fixed, info.sample, row, std::min(options.threads, height), other.data());
       },
       {}},
      {&DecodeRates::random,
       btf ? kSingleQueries : kRandomTexels,
       [&] {
         for (std::size_t i = 0; i < kSingleQueries && btf; ++i)
           btfc_eval(t, scratch.get(), &queries[i], sizeof(btfc_query), 1, &values[4 * i], 4);
         for (std::size_t i = 0; i < kRandomTexels && !btf; ++i) {
           btfc_decode_texels(t, scratch.get(), map, nullptr, &at[2 * i], 1, info.sample,
                              &batch[i * texel_bytes], texel_bytes);
         }
       },
       {}},
      {&DecodeRates::batch,
       batch_texels,
       [&] {
         if (btf) {
           btfc_eval(t, scratch.get(), queries.data(), sizeof(btfc_query), queries.size(), values.data(), 4);
           return;
         }
         btfc_decode_texels(t, scratch.get(), map, nullptr, at.data(), kRandomTexels, info.sample,
                            batch.data(), batch.size());
       },
       {}},
      {&DecodeRates::naive,
       std::size_t{naive_columns} * naive_rows,
       [&] {  // the reference, texel by texel as floats
         btfc_query query{};
         query.map = map;
         query.footprint = options.footprint;
         std::copy_n(fixed.view, 3, query.view);
         std::copy_n(fixed.light, 3, query.light);
         float value[4];
         for (query.y = 0; query.y < static_cast<std::int32_t>(naive_rows); ++query.y) {
           for (query.x = 0; query.x < static_cast<std::int32_t>(naive_columns); ++query.x) {
             btfc_eval(t, nullptr, &query, sizeof query, 1, value, 4);
             std::memcpy(batch.data(), value, sizeof(float));
           }
         }
       },
       {}},
      {&DecodeRates::copy, texels, [&] { std::memcpy(other.data(), image.data(), size); }, {}},
      {&DecodeRates::lookup,
       kRandomTexels,
       [&] {
         for (std::size_t i = 0; i < kRandomTexels; ++i) {
           const std::size_t from = static_cast<std::size_t>(at[2 * i + 1]) * row +
                                    static_cast<std::size_t>(at[2 * i]) * texel_bytes;
           std::memcpy(&batch[i * texel_bytes], &image[from], texel_bytes);
         }
       },
       {}},
  };
  if (!options.reference)
    std::erase_if(all, [](const Contestant& one) { return one.result == &DecodeRates::naive; });
  measure(all, options.seconds);
  DecodeRates rates;
  for (const Contestant& one : all) rates.*one.result = median(one.rates);
  return rates;
}

Result<std::optional<DeviceRates>> measure_shader_rates(const btfc_texture* texture, std::uint32_t map,
                                                        const RateOptions& options, bool demanded) {
  constexpr std::uint32_t kSide = 1024;
  VulkanOptions vulkan;
  // Half of the image where all of it is too much to be prepared: the texture repeats over the rest.
  vulkan.window = {0, 0, kSide, kSide};
  Result<VulkanDecoder> decoder = VulkanDecoder::open(texture, vulkan);
  for (; !decoder && decoder.error().status == Status::limit && vulkan.window.width > 64;) {
    vulkan.window.width = vulkan.window.height = vulkan.window.width / 2;
    decoder = VulkanDecoder::open(texture, vulkan);
  }
  if (!decoder) {
    if (demanded) return decoder.error();
    return std::optional<DeviceRates>();
  }
  const std::vector<std::byte> grey(std::size_t{4} * kSide * kSide, std::byte{127});
  const Result<ShaderRates> rates =
      decoder->rates(map, oblique(options.footprint), kSide, kSide, grey, 8 * options.seconds);
  if (!rates) return rates.error();
  return std::optional(DeviceRates{decoder->device_name(), *rates});
}

}  // namespace btfc
