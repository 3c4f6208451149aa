// HTML with its style, pictures as data: addresses.
#include "tools/trade_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "encoder/output/png_bytes.h"
#include "tools/svg_text.h"
#include "tools/trade_plot.h"

namespace btfc {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --ground: #fdfdfc; --ink: #1d1f23; --soft: #63676f; --line: #dddfe3; --band: #f3f4f4;
  --m1: #1f6fb4; --m2: #c2371f; --m3: #2c8a4b; --m4: #8757b8; --m5: #b0730b; --m6: #0f8a94; --m7: #c43f85; --m8: #5a6b20;
  --m9: #6b4a35; --m0: #55606e; }
@media (prefers-color-scheme: dark) {
  :root { --ground: #16181b; --ink: #e6e7e9; --soft: #9a9fa8; --line: #33373d; --band: #1e2125;
    --m1: #6fb1ea; --m2: #f2836b; --m3: #6fcf8e; --m4: #bd97ea; --m5: #e2ac4f; --m6: #58c8d0; --m7: #ef8ec0; --m8: #b3c46c;
    --m9: #c9a085; --m0: #a9b3c0; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1240px; padding: 2.2rem 1.4rem 4rem; background: var(--ground); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", "Helvetica Neue", "Liberation Sans", sans-serif; font-variant-numeric: tabular-nums; }
h1 { font-size: 1.55rem; font-weight: 600; margin: 0 0 .3rem; letter-spacing: -.01em; }
h2 { font-size: 1.08rem; font-weight: 600; margin: 2.6rem 0 .7rem; }
p { margin: .3rem 0 .8rem; max-width: 74ch; color: var(--soft); }
.plots { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 540px), 1fr)); gap: 1.6rem 2rem; }
figure { margin: 0; } figcaption { color: var(--soft); font-size: .87rem; margin-top: .2rem; }
svg { display: block; width: 100%; height: auto; } svg text { fill: var(--soft); font-size: 12px; }
svg .title { fill: var(--ink); font-size: 12.5px; font-weight: 600; }
svg .grid { stroke: var(--line); stroke-width: 1; fill: none; } svg .front { stroke: var(--ink); stroke-width: 1.2; fill: none; opacity: .55; }
svg .point { fill: var(--c); fill-opacity: .38; stroke: var(--c); stroke-width: 1; } svg .best { fill-opacity: 1; stroke: var(--ground); }
.m0 { --c: var(--m0); } .m1 { --c: var(--m1); } .m2 { --c: var(--m2); } .m3 { --c: var(--m3); } .m4 { --c: var(--m4); }
.m5 { --c: var(--m5); } .m6 { --c: var(--m6); } .m7 { --c: var(--m7); } .m8 { --c: var(--m8); } .m9 { --c: var(--m9); }
.key { display: flex; flex-wrap: wrap; gap: .2rem 1.2rem; padding: 0; margin: .6rem 0 1rem; list-style: none; }
.key svg { display: inline-block; width: 14px; height: 14px; vertical-align: -2px; margin-right: .35rem; }
.wide { overflow-x: auto; margin-bottom: 1.4rem; } table { border-collapse: collapse; font-size: .82rem; width: 100%; }
.bounds td:first-child { width: 11em; }
th { text-align: right; font-weight: 600; color: var(--soft); border-bottom: 1px solid var(--ink); vertical-align: bottom; }
th, td { padding: .22rem .42rem; text-align: right; white-space: nowrap; } td { border-bottom: 1px solid var(--line); }
th:first-child, td:first-child, th.text, td.text { text-align: left; } td.text { white-space: normal; min-width: 15em; }
tr:target td { background: var(--band); } tr.best td:first-child { font-weight: 600; }
td b { color: var(--c, var(--ink)); }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(150px, 1fr)); gap: 1.1rem 1rem; }
.pictures img { width: 100%; aspect-ratio: 1; image-rendering: pixelated; display: block; background: var(--band); }
.pictures figcaption { line-height: 1.35; overflow-wrap: anywhere; } .pictures figcaption b { color: var(--c, var(--ink)); }
a { color: inherit; }
)";

std::string base64(ByteView bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) three = three << 8 | (i + k < bytes.size() ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? kDigits[three >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

Result<std::string> picture_tag(const Image& image, const std::string& words) {
  const Result<Bytes> png = png_bytes(image);
  if (!png) return png.error();
  return fmt::format("<img alt=\"{}\" src=\"data:image/png;base64,{}\">", escaped(words), base64(*png));
}

std::string cell(const std::optional<double>& v, int digits) {
  return v ? fmt::format("<td>{:.{}f}", *v, digits) : "<td>";
}

// 0.0123 and 12.3 alike with three digits.
std::string ratio_cell(double over, double under) {
  return under > 0 ? fmt::format("<td>{:.3g}", over / under) : "<td>";
}

std::string table_row(const TradePoint& p, std::size_t number, bool best, bool distances, bool shader) {
  const MeasuredError& e = p.is.error;
  const DecodeRates& r = p.is.rates;
  std::string row =
      fmt::format("<tr id=\"p{}\" class=\"{}{}\"><td><b>{}</b><td class=\"text\">{}<td>{}<td>{}", number,
                  model_class(*p.model), best ? " best" : "", p.model->name, escaped(setting_text(p)),
                  p.is.payload_bytes, p.is.file_bytes);
  row += cell(e.psnr_db, 2) + cell(e.mae_lab, 2) + cell(e.ssim, 3) + cell(e.flip, 3);
  if (distances)
    row += cell(e.texture_distance ? e.texture_distance : e.colour_distance, 4) + cell(e.brdf_rmse_8bit, 2);
  row += fmt::format("<td>{:.1f}", p.fit_seconds);
  row += ratio_cell(r.full, r.lookup) + ratio_cell(r.random, r.lookup) + ratio_cell(r.batch, r.lookup);
  if (shader) {
    const auto device = [&](double ShaderRates::*of, double ShaderRates::*fetch) {
      return p.is.device ? ratio_cell(p.is.device->rates.*of, p.is.device->rates.*fetch) : "<td>";
    };
    row += device(&ShaderRates::full, &ShaderRates::fetch) +
           device(&ShaderRates::random_full, &ShaderRates::random_fetch);
  }
  if (!p.is.cost) return row + "<td><td>";
  return row + fmt::format("<td>{}<td>{}", p.is.cost->operations, p.is.cost->reads);
}

std::string winner_cell(const Trade& trade, const std::optional<std::size_t>& i) {
  if (!i) return "<td class=\"text\">none";
  const TradePoint& p = trade.points[*i];
  return fmt::format("<td class=\"text {}\"><a href=\"#p{}\"><b>{}</b> {}</a>, {}, {}", model_class(*p.model),
                     *i, p.model->name, escaped(setting_text(p)), error_text(p),
                     bytes_text(p.is.payload_bytes));
}

std::string winners_table(const Trade& trade, const std::vector<TradeSummary::Winner>& winners,
                          const char* title, bool bytes) {
  const auto any = [&](auto member) {
    return std::any_of(winners.begin(), winners.end(),
                       [&](const auto& w) { return (w.*member).has_value(); });
  };
  const bool texels = any(&TradeSummary::Winner::texels), texture = any(&TradeSummary::Winner::texture);
  std::string text = fmt::format("<div class=\"wide bounds\"><table><tr><th>{}", title);
  if (texels) text += "<th class=\"text\">least error texel by texel";
  if (texture) text += "<th class=\"text\">nearest texture";
  for (const auto& w : winners) {
    text += fmt::format("\n<tr><td>{}", bytes ? bytes_text(w.most) : std::to_string(w.most));
    if (texels) text += winner_cell(trade, w.texels);
    if (texture) text += winner_cell(trade, w.texture);
  }
  return text + "</table></div>\n";
}

// The models as the plots mark them.
std::string key(const Trade& trade) {
  std::string text = "<ul class=\"key\">";
  std::set<const ModelFormat*> seen;
  for (const TradePoint& p : trade.points) {
    if (seen.insert(p.model).second)
      text += fmt::format("<li><svg viewBox=\"-7 -7 14 14\"><g class=\"point best {}\">{}/></g></svg>{}",
                          model_class(*p.model), plot_mark(*p.model, 0, 0, 5), p.model->name);
  }
  return text + "</ul>\n";
}

}  // namespace

Result<std::string> trade_page(const Trade& trade, const TradeSummary& s, const Image& original) {
  const std::string name = escaped(s.input.substr(s.input.find_last_of('/') + 1));
  std::string page = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{} — btfc tradeoff</title><style>{}</style>\n<h1>{}</h1>\n",
      name, kStyle, name);
  page += fmt::format("<p>{} settings of {} fits, {:.1f} minutes.", trade.points.size(), trade.files.size(),
                      s.seconds / 60);
  if (s.pairs > 1)
    page += fmt::format(" Errors are over {} of the {} pairs of directions, SSIM and FLIP over {}.",
                        s.measured_pairs, s.pairs, s.looked_at_pairs);
  page += " Filled marks and the line are the Pareto front: no other setting is better in both.</p>\n" +
          key(trade);

  const bool rates = std::any_of(trade.points.begin(), trade.points.end(), slowness_of);
  page += "<div class=\"plots\">\n";
  const auto figure = [&](const std::string& svg, const char* caption) {
    if (!svg.empty()) page += "<figure>" + svg + "<figcaption>" + caption + "</figcaption></figure>\n";
  };
  for (const bool texels : {true, false}) {
    const Coordinate error = texels ? Coordinate(texel_error) : Coordinate(texture_error);
    const char* title = texels ? "PSNR, dB" : "distance of textures";
    const auto plot = [&](const char* x_title, const Coordinate& x, bool bytes) {
      return trade_plot(trade.points,
                        {x_title, title, x, error, texels, bytes, trade_front(trade.points, x, error)});
    };
    figure(plot("payload", payload_of, true),
           texels ? "Size against error, models that keep texels in place"
                  : "Size against distance, models that do not keep texels in place: lower is nearer");
    if (rates)
      figure(
          plot("raw look-ups in the time of a decoded texel, whole images on one core", slowness_of, false),
          "Speed: further left is faster");
    figure(plot("operations a texel in a shader", operations_of, false),
           "Analytic cost: further left is cheaper");
  }
  page += "</div>\n<h2>The best under a bound</h2>\n";
  page += winners_table(trade, s.by_bytes, "payload at most", true);
  page += winners_table(trade, s.by_operations, "operations at most", false);

  // Pictures of the front and of the winners.
  std::set<std::size_t> chosen(s.size_front.begin(), s.size_front.end());
  for (const auto* list : {&s.by_bytes, &s.by_operations}) {
    for (const auto& w : *list) {
      for (const auto& i : {w.texels, w.texture}) {
        if (i) chosen.insert(*i);
      }
    }
  }
  page += "<h2>Pictures</h2>\n<div class=\"pictures\">\n";
  const Result<std::string> first = picture_tag(original, "original");
  if (!first) return first.error();
  page += "<figure>" + *first + "<figcaption><b>original</b></figcaption></figure>\n";
  std::vector<std::size_t> order(chosen.begin(), chosen.end());
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return trade.points[a].is.payload_bytes < trade.points[b].is.payload_bytes;
  });
  for (const std::size_t i : order) {
    const TradePoint& p = trade.points[i];
    if (p.is.picture.codes.empty()) continue;
    const Result<std::string> tag = picture_tag(p.is.picture, setting_text(p));
    if (!tag) return tag.error();
    page += fmt::format(
        "<figure class=\"{}\"><a href=\"#p{}\">{}</a><figcaption><b>{}</b> {}<br>{}, "
        "{}</figcaption></figure>\n",
        model_class(*p.model), i, *tag, p.model->name, escaped(setting_text(p)),
        bytes_text(p.is.payload_bytes), error_text(p));
  }

  const bool distances = std::any_of(trade.points.begin(), trade.points.end(), [](const TradePoint& p) {
    return p.is.error.texture_distance || p.is.error.colour_distance;
  });
  const auto with_device = std::find_if(trade.points.begin(), trade.points.end(),
                                        [](const TradePoint& p) { return p.is.device.has_value(); });
  const bool shader = with_device != trade.points.end();
  page +=
      "</div>\n<h2>All settings</h2>\n<p>Rates are ratios to raw look-ups of the same run: CPU, one core, "
      "against random texels "
      "of the uncompressed image";
  if (shader)
    page +=
        fmt::format("; {}, against fetches by the same workgroups", escaped(with_device->is.device->device));
  page +=
      ". Operations and reads are those of a texel in a shader, of models that can be prepared of a prepared "
      "one. ";
  page +=
      "Models that do not keep texels in place have a distance of textures (an image: 1 is as near as "
      "another sample of the "
      "material; a BTF: of colours) in place of errors texel by texel.</p>\n";
  page +=
      "<div class=\"wide\"><table><tr><th>model<th class=\"text\">setting<th>payload<th>file<th>PSNR<th>MAE "
      "Lab<th>SSIM<th>FLIP";
  if (distances) page += "<th>distance<th>BRDF RMSE";
  page += "<th>fit s<th>full<th>random<th>batch";
  if (shader) page += "<th>GPU full<th>GPU random";
  page += "<th>operations<th>reads\n";
  for (std::size_t i = 0; i < trade.points.size(); ++i) {
    const bool best = std::find(s.size_front.begin(), s.size_front.end(), i) != s.size_front.end();
    page += table_row(trade.points[i], i, best, distances, shader) + '\n';
  }
  page += "</table></div>\n";
  if (!trade.left_out.empty() || !trade.no_time.empty()) {
    page += "<h2>Left out</h2>\n";
    if (!trade.no_time.empty())
      page += "<p>No time left for: " + escaped(fmt::format("{}", fmt::join(trade.no_time, "; "))) + "</p>\n";
    for (const std::string& line : trade.left_out) page += "<p>" + escaped(line) + "</p>\n";
  }
  return page + "</html>\n";
}

}  // namespace btfc
