// Inputs by formula, and files changed by hand.
#include "tests/extremes/extreme_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "shaders/btfc_half.h"

namespace btfc::test {
namespace {

bool is_field(const std::string& model) { return model == "car" || model == "gmrf" || model == "car3d"; }
bool is_weighted(const std::string& model) { return model == "pcarf" || model == "pca" || model == "lpca"; }

// Short fits: what they reach does not matter here.
OptionValues usual_options(const std::string& model) {
  if (model == "patch") return {{"k", "3"}};
  if (model == "gm") return {{"components", "6"}, {"iterations", "40"}};
  if (model == "pca" || model == "pcarf") return {{"rank", "3"}};
  if (model == "lpca") return {{"rank", "3"}, {"clusters", "2"}};
  if (is_field(model)) {
    return {{"levels", "2"}, {"order", "2"}, {"clusters", "2"}, {"range", "0"}, {"error", "0.01"}};
  }
  return {};
}

// What an input looks like; `bumpy` and so on look the same to a model of images, along the normal.
struct Look {
  std::uint32_t width = 9, height = 8, channels = 3;
  SampleType type = SampleType::unorm8;
  std::vector<Direction> views = rings(1), lights = rings(1);
  bool gaps = false;
  Value value = bumpy;
};

std::uint16_t code_of(SampleType type, double v) {
  if (type == SampleType::float16) return *finite_half(static_cast<float>(v));
  const double top = type == SampleType::unorm8 ? 255 : 65535;
  return static_cast<std::uint16_t>(std::lround(std::clamp(v, 0.0, 1.0) * top));
}

Image image_of(const Look& look, std::uint32_t first_channel, std::uint32_t channels) {
  Image image = constant(look.width, look.height, channels, look.type, 0);
  const Direction up = direction_from_degrees(0, 0);
  for (std::uint32_t y = 0; y < look.height; ++y) {
    for (std::uint32_t x = 0; x < look.width; ++x) {
      for (std::uint32_t c = 0; c < channels; ++c)
        image.at(x, y, c) = code_of(look.type, look.value(up, up, x, y, first_channel + c));
    }
  }
  return image;
}

class List {
 public:
  explicit List(std::string model) : model_(std::move(model)) {}

  void add(const std::string& name, Required required, double most, const Look& look,
           const OptionValues& options = {}) {
    Extreme e;
    e.name = name;
    e.model = model_;
    e.required = required;
    e.most = most;
    e.options = usual_options(model_);
    for (const auto& [key, value] : options) e.options[key] = value;
    if (model_ == "patch") {
      for (std::uint32_t c = 0; c < look.channels; c += 4)
        e.maps.push_back({fmt::format("map{}", c / 4), image_of(look, c, std::min(4u, look.channels - c))});
    } else {
      DatasetInfo info = btf_info(look.width, look.height, look.channels, look.type, look.views, look.lights);
      if (look.gaps) {
        std::erase_if(info.pairs, [](DirectionPair p) {
          return p.light != p.view && p.light > 0 && (p.light * 7 + p.view * 3) % 4 == 0;
        });
      }
      e.dataset = make_btf(std::move(info), look.value);
    }
    all_.push_back(std::move(e));
  }

  std::vector<Extreme> take() { return std::move(all_); }

 private:
  std::string model_;
  std::vector<Extreme> all_;
};

Value always(double v) {
  return [v](auto&&...) { return v; };
}

// The number of a texel and pair among all of a set, to spread codes over it.
Value counted(const Look& look, const std::function<double(std::uint32_t)>& of) {
  std::vector<Vector3> lights, views;
  for (const Direction& d : look.lights) lights.push_back(unit_vector(d));
  for (const Direction& d : look.views) views.push_back(unit_vector(d));
  const auto place = [](const std::vector<Vector3>& all, const Direction& d) {
    return static_cast<std::uint32_t>(std::find(all.begin(), all.end(), unit_vector(d)) - all.begin());
  };
  return [=, width = look.width, height = look.height](const Direction& v, const Direction& l,
                                                       std::uint32_t x, std::uint32_t y, std::uint32_t) {
    const auto pair = place(views, v) * static_cast<std::uint32_t>(lights.size()) + place(lights, l);
    return of((pair * height + y) * width + x);
  };
}

// Half floats that are finite: 63,488 of the 65,536.
double finite_half_number(std::uint32_t i) {
  const std::uint32_t of_sign = i % 31744;
  return static_cast<double>(btfc_half_to_float(of_sign | (i >= 31744 ? 0x8000u : 0u)));
}

}  // namespace

std::vector<Extreme> extremes_of(const std::string& model) {
  List list(model);
  const bool patch = model == "patch", fields = is_field(model), tables = is_weighted(model);
  // Fields keep statistics, patch keeps every code; the others come as near as their few parameters let them.
  const Required flat = patch || !fields ? Required::comes_back : Required::mean_is_kept;
  const Required kept = patch ? Required::comes_back : fields ? Required::mean_is_kept : Required::decodes;
  const double near = patch ? 0 : 0.005;
  const auto look = [](auto change) {
    Look l;
    change(l);
    return l;
  };

  list.add("1x1 texels", patch ? Required::refused : Required::decodes, 0,
           look([](Look& l) { l.width = l.height = 1; }));
  list.add("1x13 texels", patch ? Required::refused : Required::decodes, 0,
           look([](Look& l) { l.width = 1, l.height = 13; }));
  list.add("13x1 texels", patch ? Required::refused : Required::decodes, 0,
           look([](Look& l) { l.width = 13, l.height = 1; }));
  list.add("13x7 texels, primes", Required::decodes, 0, look([](Look& l) { l.width = 13, l.height = 7; }));
  if (!patch) {
    list.add("one pair of directions", model == "gm" ? Required::decodes : flat, 0.1,
             look([](Look& l) { l.views = l.lights = rings(0); }));
    list.add("one view, 19 lights", Required::decodes, 0,
             look([](Look& l) { l.views = rings(0), l.lights = rings(2); }));
    list.add("19 views, one light", Required::decodes, 0,
             look([](Look& l) { l.views = rings(2), l.lights = rings(0); }));
    list.add("missing pairs", Required::decodes, 0, look([](Look& l) { l.gaps = true; }));
    list.add("lights on one side alone", Required::decodes, 0, look([](Look& l) {
               l.lights.clear();
               for (int i = 0; i < 6; ++i) l.lights.push_back(direction_from_degrees(20 + 12 * i, 10 * i));
             }));
    list.add("all views and lights at the horizon", Required::decodes, 0, look([](Look& l) {
               l.lights.clear();
               for (int i = 0; i < 6; ++i) l.lights.push_back(direction_from_degrees(90, 60 * i));
               l.views = l.lights;
               l.value = [](const Direction& v, const Direction& d, std::uint32_t x, std::uint32_t y,
                            std::uint32_t c) {
                 return 0.3 + 0.2 * std::cos(v.phi - d.phi) + 0.02 * ((7 * x + 3 * y + c) % 9);
               };
             }));
  }
  list.add("1 channel", Required::decodes, 0, look([](Look& l) { l.channels = 1; }));
  list.add("4 channels", Required::decodes, 0, look([](Look& l) { l.channels = 4; }));
  // Of fields the least: a coupled one of 16 channels has 256 coefficients a neighbour.
  const Look sixteen = look([](Look& l) { l.channels = 16; });
  if (fields) {
    list.add("16 channels", Required::decodes, 0, sixteen, {{"levels", "1"}, {"order", "1"}});
  } else {
    list.add("16 channels", model == "gm" ? Required::refused : Required::decodes, 0, sixteen);
  }

  for (const auto& [name, v] : {std::pair{"all 0", 0.0}, {"all 1", 1.0}, {"all equal, 0.3", 0.3}})
    list.add(name, flat, near, look([v = v](Look& l) { l.value = always(v); }));
  for (const auto& [name, v] : {std::pair{"all 65504", 65504.0}, {"all 2^-24", 0x1p-24}}) {
    // gm keeps log(1 + value), to the last places of 1.
    list.add(name, model == "gm" && v < 1 ? Required::decodes : flat, near, look([v = v](Look& l) {
               l.type = SampleType::float16;
               l.value = always(v);
             }));
  }
  // Of weights as many as the data have dimensions, all comes back.
  const OptionValues whole = tables ? OptionValues{{"rank", "255"}, {"clusters", "1"}} : OptionValues{};
  const Required exact = tables ? Required::comes_back : kept;
  const double exactly = tables ? 1e-5 : fields ? 0.25 : 0;
  list.add("a texel 10^4 times the mean", exact, exactly, look([](Look& l) {
             l.type = SampleType::float16;
             l.value = [](const Direction& v, const Direction& d, std::uint32_t x, std::uint32_t y,
                          std::uint32_t c) { return x == 4 && y == 3 ? 5000.0 : bumpy(v, d, x, y, c); };
           }),
           whole);
  list.add("65504 beside 2^-24 and 0", exact, exactly, look([](Look& l) {
             l.type = SampleType::float16;
             l.value = [](const Direction&, const Direction& d, std::uint32_t x, std::uint32_t y,
                          std::uint32_t) {
               const int kind = static_cast<int>((x + 2 * y) % 3);
               return kind == 0 ? 0.0 : kind == 1 ? 0x1p-24 : 65504 / (1 + d.theta);
             };
           }),
           whole);
  list.add("values from -1 to 1", exact, exactly, look([](Look& l) {
             l.type = SampleType::float16;
             l.value = [](const Direction& v, const Direction& d, std::uint32_t x, std::uint32_t y,
                          std::uint32_t c) { return 2 * bumpy(v, d, x, y, c) - 1; };
           }),
           whole);
  list.add("half floats below the least normal one", exact, exactly, look([](Look& l) {
             l.type = SampleType::float16;
             l.value = [](const Direction& v, const Direction& d, std::uint32_t x, std::uint32_t y,
                          std::uint32_t c) { return 0x1p-14 * bumpy(v, d, x, y, c); };
           }),
           whole);
  {
    Look l;
    l.type = SampleType::float16;
    l.channels = 1;
    l.width = patch ? 256 : 32;
    l.height = patch ? 248 : 31;
    l.views.clear();
    for (int i = 0; i < 8; ++i) l.views.push_back(direction_from_degrees(10 * i, 50 * i));
    l.lights = l.views;
    if (patch) l.views = l.lights = rings(0);
    l.value = patch ? Value([](const Direction&, const Direction&, std::uint32_t x, std::uint32_t y,
                               std::uint32_t) { return finite_half_number(256 * y + x); })
                    : counted(l, finite_half_number);
    // Statistics of such values say nothing: neighbours in a row differ by a last place, rows by signs.
    list.add("all 63,488 finite half floats", patch || tables ? exact : Required::decodes,
             tables ? 1e-4 : exactly, l, whole);
  }

  if (!patch) {
    // Every texel is a multiple of one reflectance: rank 1.
    const Look one = look([](Look& l) {
      l.value = [](const Direction& v, const Direction& d, std::uint32_t x, std::uint32_t y, std::uint32_t) {
        return (0.2 + 0.1 * ((x + 3 * y) % 7)) * (0.3 + 0.4 * std::cos(v.theta) * std::cos(d.theta));
      };
    });
    if (tables) {
      list.add("rank 1 stored with rank 40", Required::comes_back, 0.005, one, {{"rank", "40"}});
      list.add("rank 1 stored with rank 1", model == "pcarf" ? Required::comes_back : Required::decodes,
               0.005, one, {{"rank", "1"}});
      list.add("rank 0: means alone", Required::decodes, 0, one, {{"rank", "0"}});
    }
    if (model == "lpca") {
      list.add("a cluster a texel, rank 0", Required::comes_back, 1e-5, {},
               {{"clusters", "72"}, {"rank", "0"}});
      list.add("more clusters than texels", Required::comes_back, 1e-5, {},
               {{"clusters", "999"}, {"rank", "7"}});
    }
    if (model == "plm") {
      list.add("a codebook of one lobe", Required::decodes, 0, {}, {{"clusters", "1"}});
      list.add("more lobes than texels", Required::decodes, 0, {}, {{"clusters", "256"}});
    }
    if (model == "ptm") {
      list.add("one light for six terms", Required::comes_back, 0.005,
               look([](Look& l) { l.lights = rings(0); }));
    }
    if (model == "gm") {
      list.add("one component", Required::decodes, 0, {}, {{"components", "1"}});
      list.add("4,096 components, more than there are samples of", Required::decodes, 0,
               look([](Look& l) { l.width = l.height = 5; }), {{"components", "4096"}, {"iterations", "3"}});
      list.add("every component a gate's", Required::decodes, 0, {}, {{"gates", "6"}});
      list.add("fit by EM of a constant", Required::comes_back, 0.005,
               look([](Look& l) { l.value = always(0.5); }), {{"fit", "em"}, {"iterations", "5"}});
    }
    for (const char* precision : {"f16", "u8"}) {
      if (fields && precision[0] == 'u') continue;
      const std::string name = std::string("values to 65504, parameters in ") + precision;
      list.add(name, Required::decodes, 0, look([](Look& l) {
                 l.type = SampleType::float16;
                 l.value = [](const Direction& v, const Direction& d, std::uint32_t x, std::uint32_t y,
                              std::uint32_t c) {
                   return x == 2 && y == 1 ? 65504.0 : 1000 * bumpy(v, d, x, y, c);
                 };
               }),
               {{"precision", precision}});
    }
  }
  if (fields) {
    list.add("order 0: noise", Required::mean_is_kept, 0.2, {}, {{"order", "0"}, {"levels", "1"}});
    list.add("40 neighbours", Required::decodes, 0, {}, {{"order", "40"}, {"levels", "1"}});
    list.add("8 levels of 9x8 texels", Required::decodes, 0, {}, {{"levels", "8"}});
    list.add("a subspace a pair", Required::decodes, 0, {}, {{"clusters", "49"}, {"levels", "1"}});
  }
  if (fields || patch) {
    const auto pattern = [&](const char* name, auto high) {
      list.add(name, kept, patch ? 0 : 0.25, look([&](Look& l) {
                 l.width = l.height = 16;
                 l.value = [high](const Direction&, const Direction&, std::uint32_t x, std::uint32_t y,
                                  std::uint32_t) { return high(x, y) ? 0.8 : 0.1; };
               }));
    };
    pattern("stripes of two colours", [](std::uint32_t x, std::uint32_t) { return x % 4 < 2; });
    pattern("a chequerboard", [](std::uint32_t x, std::uint32_t y) { return (x + y) % 2 == 0; });
    list.add("4x4 texels", Required::decodes, 0, look([](Look& l) { l.width = l.height = 4; }));
  }
  if (patch) {
    const Look wide = look([](Look& l) { l.width = 257, l.height = 16; });
    list.add("2x2 texels", Required::comes_back, 0, look([](Look& l) { l.width = l.height = 2; }));
    list.add("one patch, no overlap", Required::comes_back, 0, {}, {{"k", "1"}, {"we", "0"}, {"wb", "8"}});
    list.add("a sample of exactly one patch's size", Required::comes_back, 0,
             look([](Look& l) { l.width = l.height = 8; }), {{"wb", "8"}});
    list.add("overlap of one texel", Required::comes_back, 0, {}, {{"wb", "7"}, {"we", "1"}});
    list.add("overlap of half a patch", Required::comes_back, 0, {}, {{"wb", "8"}, {"we", "4"}});
    list.add("a patch larger than the sample", Required::refused, 0, {}, {{"wb", "9"}});
    list.add("an overlap of more than half a patch", Required::refused, 0, {}, {{"wb", "8"}, {"we", "5"}});
    list.add("256 texels a side, coordinates of 8 bits", Required::comes_back, 0,
             look([](Look& l) { l.width = 256, l.height = 16; }));
    list.add("257 texels a side, coordinates of 16 bits", Required::comes_back, 0, wide);
    list.add("wraps, one patch", Required::comes_back, 0, {}, {{"k", "1"}, {"tileable", ""}, {"wb", "6"}});
    list.add("wraps, two patches", Required::comes_back, 0, {}, {{"k", "2"}, {"tileable", ""}, {"wb", "6"}});
    list.add("trimmed, one corner used", Required::comes_back, 0, wide,
             {{"k", "1"}, {"we", "0"}, {"wb", "8"}, {"trim-sample", ""}});
    list.add("trimmed, all used", Required::comes_back, 0, look([](Look& l) { l.width = l.height = 8; }),
             {{"k", "1"}, {"we", "0"}, {"wb", "8"}, {"trim-sample", ""}});
  }
  return list.take();
}

Extreme ordinary_input(const std::string& model) {
  List list(model);
  Look look;
  look.width = look.height = 24;
  look.views = look.lights = rings(2);
  list.add("ordinary", Required::decodes, 0, look,
           model == "gm" ? OptionValues{{"iterations", "400"}} : OptionValues{});
  return std::move(list.take().front());
}

}  // namespace btfc::test
