// A trade-off as a page that needs nothing from outside: plots, a table, thumbnails.
#pragma once
#include <string>

#include "encoder/image.h"
#include "tools/trade_report.h"

namespace btfc {

// original: what thumbnails are held against.
Result<std::string> trade_page(const Trade& trade, const TradeSummary& summary, const Image& original);

}  // namespace btfc
