// Model gmrf: Gaussian Markov random fields on tori (survey section 5.3.1; spec/models/car.md).
#ifndef BTFC_GMRF_H
#define BTFC_GMRF_H
#include "../btfc_field.h"

BTFC_BEGIN

// Slot 0: tables, records and numbers; slot 1: tori, made when the file is read.
BTFC_FN vec4 gmrf_eval(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(BtfcQuery) query) {
  return field_eval(words, p, query);
}

BTFC_END
#endif
