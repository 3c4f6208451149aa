// What the table of extremes is made of, for extremes_table.py.
// btfc_extremes files DIR N [MODEL]: fits every input, asks every file N queries of each kind, and writes the
// files, their answers and DIR/cases.json. btfc_extremes sums N: accumulations over N samples, as JSON.
// btfc_extremes answers FILE…: a hash of each file's answers under every instruction set of this processor.
// btfc_extremes fits: each model's fit of one input, hashed, and how near it comes.
#include <fmt/format.h>
#include <hwy/targets.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>

#include "encoder/output/atomic_file.h"
#include "format/chunk_codec.h"
#include "tests/extremes/accumulations.h"
#include "tests/extremes/extreme_decode.h"
#include "tests/extremes/extreme_inputs.h"

namespace btfc::test {
namespace {

using Json = nlohmann::ordered_json;

// How far what was fitted is from what comes out, of the largest original value.
struct Distance {
  double worst = 0, mean = 0, rms = 0;
  double largest = 0;  // original value
};

Distance from_dataset(const Dataset& set, const btfc_texture* texture) {
  const DatasetInfo& info = set.info();
  double largest = 0, worst = 0, sum = 0, wanted_sum = 0, squares = 0, count = 0;
  std::vector<float> values;
  const std::unique_ptr<btfc_scratch, ScratchFree> scratch(btfc_scratch_new(texture));
  for (std::size_t p = 0; p < info.pairs.size(); ++p) {
    btfc_directions look{{}, {}, 1, 0};
    const Vector3 view = unit_vector(info.views[info.pairs[p].view]),
                  light = unit_vector(info.lights[info.pairs[p].light]);
    for (std::size_t i = 0; i < 3; ++i) {
      look.view[i] = static_cast<float>(view[i]);
      look.light[i] = static_cast<float>(light[i]);
    }
    std::uint32_t first = 0;
    for (std::uint32_t map = 0; map < btfc_texture_maps(texture); ++map) {
      btfc_map_info m{};
      btfc_texture_map_info(texture, map, &m);
      values.resize(std::size_t{info.width} * info.height * m.channels);
      btfc_decode_rect(texture, scratch.get(), map, &look, 0, 0, info.width, info.height, BTFC_FLOAT32,
                       values.data(), values.size() * 4 / info.height, values.size() * 4);
      for (std::size_t i = 0; i < values.size(); ++i) {
        const auto texel = static_cast<std::uint32_t>(i / m.channels);
        const double wanted = static_cast<double>(
            code_value(info.type, set.code(p, texel % info.width, texel / info.width,
                                           first + static_cast<std::uint32_t>(i % m.channels))));
        const double found = static_cast<double>(values[i]);
        largest = std::max(largest, std::fabs(wanted));
        worst = std::max(worst, std::fabs(found - wanted));
        squares += (found - wanted) * (found - wanted);
        sum += found;
        wanted_sum += wanted;
        ++count;
      }
      first += m.channels;
    }
  }
  const double unit = largest > 0 ? largest : 1;
  return {worst / unit, std::fabs(sum - wanted_sum) / count / unit, std::sqrt(squares / count) / unit,
          largest};
}

// A model of images has a picture of its own: what was synthesised.
Distance from_picture(const std::vector<SideImage>& wanted, const Bytes& file) {
  const std::vector<Image> found = decode(file);
  Distance d;
  for (std::size_t m = 0; m < found.size(); ++m) {
    if (m >= wanted.size() || wanted[m].image.codes != found[m].codes) d.worst = d.mean = 1;
  }
  return d;
}

Result<FitResult> fit_extreme(const Extreme& e, unsigned threads) {
  FitSettings settings;
  settings.options = e.options;
  settings.threads = threads;
  if (e.model == "patch") settings.options["synthesized"] = "shown.png";
  FitInput input;
  input.maps = e.maps;
  if (e.dataset) input.dataset = &*e.dataset;
  return fitter(find_model(e.model.c_str())->id).fit(input, settings);
}

bool finite(const std::vector<float>& values) {
  return std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); });
}

double worst_of(const std::vector<float>& a, const std::vector<float>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = std::max(worst, std::fabs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  return worst;
}

class Maker {
 public:
  Maker(std::string folder, std::size_t each) : folder_(std::move(folder)), each_(each) {}

  void add(const Extreme& e) {
    Json row = {{"model", e.model},
                {"name", e.name},
                {"required", kRequired[static_cast<int>(e.required)]},
                {"most", e.most}};
    const Result<FitResult> fitted = fit_extreme(e, 2);
    if (!fitted) {
      row["message"] = fitted.error().message;
      rows_.push_back(std::move(row));
      return;
    }
    const Result<Bytes> file = pack_file(fitted->chunks);
    if (!file) {
      row["message"] = file.error().message;
      rows_.push_back(std::move(row));
      return;
    }
    decode_into(*file, row);
    if (row.contains("file")) {
      const TexturePtr texture = load(*file);
      const Distance d =
          e.dataset ? from_dataset(*e.dataset, texture.get()) : from_picture(fitted->side_images, *file);
      row["largest"] = std::max(row["largest"].get<double>(), d.largest);
      row["worst"] = d.worst;
      row["mean"] = d.mean;
    }
    rows_.push_back(std::move(row));
  }

  void add(const MadeFile& m) {
    Json row = {{"model", m.model}, {"name", m.name}, {"required", "made"}, {"most", 0}};
    decode_into(m.file, row);
    rows_.push_back(std::move(row));
  }

  // The same input on one, two and eight threads.
  void add_threads(const std::string& model) {
    std::vector<Bytes> files;
    for (const Extreme& e : extremes_of(model)) {
      if (e.name != "13x7 texels, primes") continue;
      for (const unsigned threads : {1u, 2u, 8u}) {
        const Result<FitResult> fitted = fit_extreme(e, threads);
        files.push_back(fitted ? *pack_file(fitted->chunks) : Bytes());
      }
    }
    rows_.push_back({{"model", model},
                     {"name", "encoded on 1, 2 and 8 threads"},
                     {"required", "equal"},
                     {"equal", files[0] == files[1] && files[0] == files[2] && !files[0].empty()}});
  }

  bool write() const {
    const std::string text = Json(rows_).dump(0);
    return static_cast<bool>(write_file(
        folder_ + "/cases.json", ByteView(reinterpret_cast<const std::uint8_t*>(text.data()), text.size())));
  }

 private:
  static constexpr const char* kRequired[] = {"decodes", "comes back", "mean", "refused"};

  // Verifies, decodes in every way, and writes the file down.
  void decode_into(const Bytes& file, Json& row) {
    const Result<Done> good = verify_bytes(file);
    if (!good) {
      row["message"] = good.error().message;
      row["rule"] = good.error().rule;
      return;
    }
    const TexturePtr texture = load(file);
    const std::vector<Query> queries = queries_of(texture.get(), each_);
    const Asked plain = ask(file, queries), flushed = ask(file, queries, true);
    const Answers& values = plain.answers;
    double largest = 0;
    for (const auto* all : {&values.values, &values.batch, &values.whole}) {
      for (const float v : *all) largest = std::max(largest, std::fabs(static_cast<double>(v)));
    }
    row["largest"] = largest;
    bool all_finite = true;
    double moved = 0;
    for (const auto part : {&Answers::values, &Answers::batch, &Answers::whole}) {
      all_finite = all_finite && finite(values.*part) && finite(flushed.answers.*part);
      moved = std::max(moved, worst_of(values.*part, flushed.answers.*part));
    }
    row["finite"] = all_finite;
    row["flushed"] = moved;
    bool equal = true;
    for (const std::size_t threads : {2u, 8u})
      equal = equal && ask_on_threads(texture.get(), queries, threads) == values;
    row["threads_equal"] = equal;
    const std::string name = fmt::format("{}.btfc", rows_.size());
    row["file"] = name;
    Json asked = Json::array();
    for (std::size_t i = 0; i < queries.size(); ++i) {
      const btfc_query& q = queries[i].query;
      btfc_map_info map{};
      btfc_texture_map_info(texture.get(), q.map, &map);
      // Numbers as text: JSON has no infinities.
      std::vector<std::string> view, light, answer;
      for (int c = 0; c < 3; ++c) {
        view.push_back(fmt::format("{:.9g}", q.view[c]));
        light.push_back(fmt::format("{:.9g}", q.light[c]));
      }
      for (std::uint32_t c = 0; c < map.channels; ++c)
        answer.push_back(fmt::format("{:.9g}", values.values[4 * i + c]));
      asked.push_back({{"kind", kQueryKinds[queries[i].kind]},
                       {"map", q.map},
                       {"x", q.x},
                       {"y", q.y},
                       {"view", view},
                       {"light", light},
                       {"values", answer}});
    }
    row["queries"] = std::move(asked);
    if (!write_file(folder_ + "/" + name, file)) row["message"] = "not written";
  }

  std::string folder_;
  std::size_t each_;
  std::vector<Json> rows_;
};

std::uint64_t hash_of(const Answers& answers) {
  Bytes bytes;
  for (const auto* part : {&answers.values, &answers.batch, &answers.whole}) {
    for (const float v : *part) {
      for (int shift = 0; shift < 32; shift += 8)
        bytes.push_back(static_cast<std::uint8_t>(std::bit_cast<std::uint32_t>(v) >> shift));
    }
  }
  return content_hash(bytes);
}

int print_answers(int count, char** paths) {
  Json all = Json::object();
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    Json hashes = Json::object();
    for (int i = 0; i < count; ++i) {
      const Result<Bytes> file = read_file(paths[i]);
      const TexturePtr texture = file ? load(*file) : nullptr;
      if (!texture) {
        std::fprintf(stderr, "btfc_extremes: %s does not load\n", paths[i]);
        return 3;
      }
      hashes[paths[i]] =
          fmt::format("{:016x}", hash_of(ask_on_threads(texture.get(), queries_of(texture.get(), 8), 1)));
    }
    all[hwy::TargetName(target)] = std::move(hashes);
  }
  hwy::SetSupportedTargetsForTest(0);
  std::printf("%s\n", all.dump(0).c_str());
  return 0;
}

// Each model's fit of one set on 1, 2 and 8 threads: a hash of its raw chunks, and how near it comes.
int print_fits() {
  Json all = Json::array();
  for (const ModelFormat& model : models()) {
    const Extreme e = ordinary_input(model.name);
    Json row = {{"model", model.name}};
    for (const unsigned threads : {1u, 2u, 8u}) {
      const Result<FitResult> fitted = fit_extreme(e, threads);
      if (!fitted) {
        std::fprintf(stderr, "btfc_extremes: %s: %s\n", model.name, fitted.error().message.c_str());
        return 1;
      }
      const Bytes file = *pack_file(fitted->chunks, PackOptions{Codec::raw, 1, 4});
      row["hashes"].push_back(fmt::format("{:016x}", content_hash(file)));
      if (threads > 1) continue;
      row["psnr_db"] = e.dataset ? -20 * std::log10(from_dataset(*e.dataset, load(file).get()).rms) : 0.0;
    }
    all.push_back(std::move(row));
  }
  std::printf("%s\n", all.dump(0).c_str());
  return 0;
}

int print_sums(std::uint64_t samples) {
  Json all = Json::array();
  for (const Accumulation& a : accumulations(samples))
    all.push_back({{"models", a.models},
                   {"name", a.name},
                   {"unit", a.unit},
                   {"error", a.error},
                   {"bound", a.bound},
                   {"samples", a.samples}});
  std::printf("%s\n", all.dump(0).c_str());
  return 0;
}

int write_files(const char* folder, std::size_t each, const std::string& only) {
  Maker maker(folder, each);
  for (const ModelFormat& model : models()) {
    if (!only.empty() && only != model.name) continue;
    for (const Extreme& e : extremes_of(model.name)) maker.add(e);
    for (const MadeFile& m : made_files_of(model.name)) maker.add(m);
    maker.add_threads(model.name);
  }
  return maker.write() && !testing::Test::HasFailure() ? 0 : 1;
}

}  // namespace
}  // namespace btfc::test

int main(int argc, char** argv) {
  const std::string verb = argc > 2 ? argv[1] : "";
  if (verb == "files" && (argc == 4 || argc == 5))
    return btfc::test::write_files(argv[2], std::strtoul(argv[3], nullptr, 10), argc == 5 ? argv[4] : "");
  if (verb == "sums" && argc == 3) return btfc::test::print_sums(std::strtoull(argv[2], nullptr, 10));
  if (argc == 2 && std::strcmp(argv[1], "fits") == 0) return btfc::test::print_fits();
  if (verb == "answers") return btfc::test::print_answers(argc - 2, argv + 2);
  std::fprintf(stderr, "usage: btfc_extremes files DIR N [MODEL] | sums N | answers FILE… | fits\n");
  return 1;
}
