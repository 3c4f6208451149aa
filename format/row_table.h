// Many short rows of elements over several word slots: a row never straddles two slots.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "format/coded_rows.h"
#include "format/limits.h"
#include "format/loaded_item.h"

namespace btfc {

struct RowTable {
  std::uint64_t rows = 0, elements = 0;  // elements a row; 0: the table is empty
  Precision precision = Precision::f32;
  std::uint32_t first_slot = 1, slots = 3;

  // As many as fit into kMaxChunkBytes. At least 1 where elements are at most 2^25.
  std::uint32_t rows_per_slot() const {
    if (elements == 0) return 1;
    const std::uint64_t most = kMaxChunkBytes / (elements * element_bytes(precision));
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(most, UINT32_MAX));
  }
  bool fits() const {
    return elements == 0 || (rows_per_slot() > 0 && ceil_div(rows, rows_per_slot()) <= slots);
  }
  std::uint64_t words() const {
    if (elements == 0) return 0;
    const std::uint64_t full = rows / rows_per_slot(), rest = rows % rows_per_slot();
    return full * element_words(rows_per_slot() * elements, precision) +
           element_words(rest * elements, precision);
  }
};

// Fills the slots of an item; the table fits.
class RowTableWriter {
 public:
  RowTableWriter(const RowTable& table, LoadedItem& item) : table_(table), item_(item) {
    for (std::uint64_t done = 0, slot = table.first_slot; table.elements != 0 && done < table.rows; ++slot) {
      const std::uint64_t rows = std::min<std::uint64_t>(table.rows_per_slot(), table.rows - done);
      item.words[slot].resize(element_words(rows * table.elements, table.precision));
      done += rows;
    }
  }
  void set(std::uint64_t row, std::uint64_t element, std::uint32_t bits) {
    const std::uint64_t index = row % table_.rows_per_slot() * table_.elements + element;
    const std::uint64_t bit = index * 8 * element_bytes(table_.precision);
    item_.words[table_.first_slot + row / table_.rows_per_slot()][bit >> 5] |= bits << (bit & 31);
  }

 private:
  RowTable table_;
  LoadedItem& item_;
};

}  // namespace btfc
