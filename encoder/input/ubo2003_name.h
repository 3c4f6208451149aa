// The file names of UBO2003, ATRIUM, UTIA and SPECTRAL: "00001 tl015 pl060 tv030 pv000.jpg".
#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace btfc {

// Degrees, as the name has them.
struct Ubo2003Angles {
  double light_theta = 0, light_phi = 0, view_theta = 0, view_phi = 0;
};

// The numbers behind tl, pl, tv and pv, in any order and case, with a blank, an underscore or nothing
// between;
// "-30" and "23.5" are numbers. Empty unless each key comes exactly once, not behind a letter. The name comes
// without its folders and extension.
std::optional<Ubo2003Angles> ubo2003_angles(std::string_view name);

// Whether the name is UTIA's: "tl015_pl060_tv030_pv000" and nothing before.
bool is_utia_name(std::string_view name);

// "015", "023.5", "007.692308": three digits, and decimals where the angle has them, at most six.
std::string ubo2003_angle_text(double angle);

}  // namespace btfc
