// Files that no fit gives: parameters below the least normal number, mixtures and fields at their ends.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "encoder/output/atomic_file.h"
#include "encoder/split_mix.h"
#include "format/models/gm_payload.h"
#include "tests/extremes/extreme_inputs.h"
#include "tests/models/field_support.h"

namespace btfc::test {
namespace {

// Chunks of other things than binary32 numbers.
bool holds_floats(std::uint32_t type) {
  static const std::set<std::uint32_t> others = {four_cc("HEAD"), four_cc("PARM"), four_cc("DIRS"),
                                                 four_cc("CLUS"), four_cc("SIDX"), four_cc("RMAP"),
                                                 four_cc("META")};
  return !others.contains(type);
}

// Every binary32 number of the payload times a power of two.
Bytes scaled(const Bytes& file, float factor) {
  Parts parts = take_apart(file);
  for (std::size_t i = 0; i < parts.entries.size(); ++i) {
    if (!holds_floats(parts.entries[i].key.type)) continue;
    Bytes& raw = parts.stored[i];
    for (std::size_t at = 0; at + 4 <= raw.size(); at += 4) {
      float number;
      std::memcpy(&number, &raw[at], 4);
      number *= factor;
      std::memcpy(&raw[at], &number, 4);
    }
  }
  Bytes out = put_together(parts);
  repair_hashes(out);
  return out;
}

// A mixture by its rows (spec/models/gm.md 1): six middles, six log2 of spreads, the peak, three colours, two
// heights. One pair of directions.
using Component = std::array<float, 18>;
constexpr std::size_t kSpread = 6, kPeak = 12, kColour = 13, kHeight = 16;

Component component(SplitMix64& random) {
  Component c{};
  for (std::size_t n = 0; n < 6; ++n) {
    c[n] = static_cast<float>(n < 2 ? 12 * random.uniform() : 2 * random.uniform() - 1);
    c[kSpread + n] = static_cast<float>(n < 2 ? 2 * random.uniform() : -2 * random.uniform());
  }
  c[kPeak] = static_cast<float>(4 * random.uniform() - 2);
  for (std::size_t i = 0; i < 3; ++i) c[kColour + i] = static_cast<float>(random.uniform() - 0.5);
  for (std::size_t i = 0; i < 2; ++i) c[kHeight + i] = static_cast<float>(random.uniform() - 0.5);
  return c;
}

Bytes mixture_file(const std::vector<Component>& parts, std::uint32_t gates) {
  std::vector<float> values;
  for (std::size_t r = 0; r < std::tuple_size_v<Component>; ++r) {
    for (const Component& c : parts) values.push_back(c[r]);
  }
  Head head;
  head.model = ModelId::gm;
  head.width = 12;
  head.height = 11;
  head.wrap_u = head.wrap_v = Wrap::repeat;
  head.maps = {Map{}};
  head.maps[0].channels = 3;
  GmParm parm;
  parm.components = static_cast<std::uint32_t>(parts.size());
  parm.gates = gates;
  parm.levels = 1;
  parm.layout = GmLayout::compact;
  parm.precision = Precision::f32;
  parm.mean = GmMeanForm::f32;
  parm.shear = true;
  const DirectionPoint point = point_of(0, 0);
  GmPayload payload{{{point}, {point}, {{0, 0}}},
                    code_rows(values, std::tuple_size_v<Component>, parts.size(), Precision::f32),
                    {}};
  payload.mean.form = parm.mean;
  payload.mean.views = payload.mean.lights = payload.mean.pairs = 1;
  payload.mean.channels = 3;
  payload.mean.table = {0.25f, 0.5f, 0.75f};
  return *pack_file(gm_write(head, parm, payload));
}

std::vector<MadeFile> mixtures() {
  std::vector<MadeFile> all;
  const auto add = [&](const char* name, std::size_t count, auto change, std::uint32_t gates = 0) {
    SplitMix64 random(5);
    std::vector<Component> parts;
    for (std::size_t m = 0; m < count; ++m) parts.push_back(component(random));
    for (std::size_t m = 0; m < count; ++m) change(parts, m);
    all.push_back({name, "gm", mixture_file(parts, gates)});
  };
  const auto same = [](auto&, std::size_t) {};
  add("by hand: one component", 1, same);
  add("by hand: 4,096 components", 4096, same);
  add("by hand: 4,096 components, 8 gates", 4096, same, 8);
  add("by hand: every component twice", 40, [](auto& p, std::size_t m) { p[m] = p[m - m % 2]; });
  add("by hand: spreads at the floor, 2^-12", 40, [](auto& p, std::size_t m) {
    for (std::size_t n = 0; n < 6; ++n) p[m][kSpread + n] = -12;
  });
  add("by hand: spreads of 10^4 times the domain", 40, [](auto& p, std::size_t m) {
    for (std::size_t n = 0; n < 6; ++n) p[m][kSpread + n] = n < 2 ? 17 : 15;
  });
  add("by hand: every gate below 2^-126", 40, [](auto& p, std::size_t m) {
    for (std::size_t n = 2; n < 6; ++n) p[m][n] = 1.4f, p[m][kSpread + n] = -3;
    p[m][kPeak] -= 145;
  });
  add("by hand: peaks from 2^-1000 to 2^1000", 40,
      [](auto& p, std::size_t m) { p[m][kPeak] = static_cast<float>(m % 3) * 1000 - 1000; });
  return all;
}

}  // namespace

std::vector<MadeFile> made_files_of(const std::string& model) {
  std::vector<MadeFile> all;
  for (const std::filesystem::path& path : vectors_of(model.c_str())) {
    if (path.stem() != "rgb8_f32") continue;
    const Bytes file = *read_file(path.string());
    all.push_back({"stored numbers below 2^-126", model, scaled(file, 0x1p-130f)});
    all.push_back({"stored numbers near 2^-100", model, scaled(file, 0x1p-100f)});
  }
  if (model == "gm") {
    for (MadeFile& m : mixtures()) all.push_back(std::move(m));
  }
  if (model == "car" || model == "gmrf" || model == "car3d") {
    FieldRecipe recipe = rich_recipe(find_model(model)->id);
    recipe.levels = 1;
    recipe.margin = 96;
    recipe.whole = model == "gmrf" ? 0.45 : 0.9;  // of gmrf each stands on both sides
    all.push_back({"by hand: coefficients that add up to 0.9", model, file_of(make_field(recipe))});
    MadeField edge = make_field(recipe);
    const std::size_t n = edge.shape.neighbours(0, 0);
    // The first factor's or record's coefficients, all the same and positive, add up to 1 or above.
    const std::size_t at = edge.shape.coupled() ? edge.shape.factors * (edge.shape.factors + 1) / 2 : 1;
    const std::size_t many = edge.shape.coupled() ? n * edge.shape.factors * edge.shape.factors : n;
    for (std::size_t i = 0; i < many; ++i) edge.payload.levels[0][at + i] = 1.0f / static_cast<float>(n);
    all.push_back({"by hand: coefficients at the unit circle", model,
                   *pack_file(field_write(edge.head, edge.shape, edge.payload))});
  }
  return all;
}

}  // namespace btfc::test
