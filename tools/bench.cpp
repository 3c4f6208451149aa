// btfc bench: decode rates of the CPU through the public interface, beside a copy of the same bytes, and of
// the shader, beside plain fetches.
#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "tools/command.h"
#include "tools/decode_rates.h"
#include "tools/texture_file.h"

namespace btfc {
namespace {

struct Arguments {
  std::string input, map;
  double seconds = 0.4;
  float footprint = 1;
  unsigned threads = 1;
  std::string device = "auto";
  Report report;
};

// The shader's rates into json and text. A machine without Vulkan is no fault unless Vulkan was asked for.
Result<Done> add_shader_rates(const Arguments& a, const btfc_texture* t, std::uint32_t map, Json& json,
                              std::string& text) {
  if (a.device == "cpu") return Done{};
  const auto measured = measure_shader_rates(t, map, {a.seconds, a.footprint}, a.device == "vulkan");
  if (!measured) return measured.error();
  if (!*measured) return Done{};
  const ShaderRates& rates = (*measured)->rates;
  json["vulkan_device"] = (*measured)->device;
  text += fmt::format("\n{}, {}x{} texels:", (*measured)->device, rates.width, rates.height);
  const std::pair<const char*, double> named[] = {{"vulkan_full_mtexel_s", rates.full},
                                                  {"vulkan_fetch_mtexel_s", rates.fetch},
                                                  {"vulkan_random_mtexel_s", rates.random_full},
                                                  {"vulkan_random_fetch_mtexel_s", rates.random_fetch}};
  for (const auto& [name, rate] : named) {
    json[name] = rate / 1e6;
    text += fmt::format("\n{:<28} {:10.2f}", name, rate / 1e6);
  }
  return Done{};
}

int run(Arguments& a) {
  a.report.give_back(a.input);
  const auto stop = [](const Error& e) { return fail("bench", e); };
  if (a.input.empty()) return stop(bad_argument("IN.btfc is missing"));
  const Result<TexturePtr> texture = load_texture(a.input);
  if (!texture) return stop(texture.error());
  std::uint32_t map = 0;
  if (!a.map.empty()) {
    const Result<std::uint32_t> number = map_number(texture->get(), a.map);
    if (!number) return stop(number.error());
    map = *number;
  }
  const btfc_texture* t = texture->get();
  btfc_map_info info{};
  btfc_texture_map_info(t, map, &info);
  const std::uint32_t width = btfc_texture_width(t), height = btfc_texture_height(t);
  const DecodeRates rates = measure_rates(t, map, {a.seconds, a.footprint, a.threads});
  const std::pair<const char*, double> named[] = {
      {"cpu_full_mtexel_s", rates.full},   {"cpu_random_mtexel_s", rates.random},
      {"cpu_batch_mtexel_s", rates.batch}, {"cpu_naive_mtexel_s", rates.naive},
      {"memcpy_mtexel_s", rates.copy},     {"raw_random_mtexel_s", rates.lookup}};
  Json json = {
      {"file", a.input}, {"map", info.name}, {"width", width}, {"height", height}, {"threads", a.threads}};
  std::string text =
      fmt::format("{}: map {}, {}x{}, one thread (full: {})", a.input, info.name, width, height, a.threads);
  for (const auto& [name, rate] : named) {
    json[name] = rate / 1e6;
    text += fmt::format("\n{:<22} {:10.2f}", name, rate / 1e6);
  }
  if (const auto done = add_shader_rates(a, t, map, json, text); !done) return stop(done.error());
  if (const auto wrote = a.report.write(text, json); !wrote) return stop(wrote.error());
  return kExitOk;
}

}  // namespace

Verb add_bench(CLI::App& app) {
  auto a = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("bench", "decode rates in million texels a second");
  verb->add_option("IN.btfc", a->input, "the file");
  verb->add_option("--map", a->map, "the map (default: the first)")->type_name("NAME");
  verb->add_option("--seconds", a->seconds, "time for each measure (default 0.4)")
      ->check(CLI::Range(0.01, 60.0))
      ->type_name("S");
  verb->add_option("--footprint", a->footprint, "as of decode (default 1)")
      ->check(CLI::Range(1.0f, 1048576.0f))
      ->type_name("N");
  verb->add_option("--threads", a->threads, "of cpu_full_mtexel_s; all else has one (default 1)")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  verb->add_option("--device", a->device,
                   "cpu, or vulkan: the shader too, which must be possible (default: the shader where it is)")
      ->check(CLI::IsMember({"auto", "cpu", "vulkan"}))
      ->type_name("cpu|vulkan");
  a->report.attach(*verb);
  return {verb, [a] { return run(*a); }};
}

}  // namespace btfc
