// Model car: causal autoregressive factors (Haindl, Filip; spec/models/car.md).
#ifndef BTFC_CAR_H
#define BTFC_CAR_H
#include "../btfc_field.h"

BTFC_BEGIN

// Slot 0: tables, records and numbers; slot 1: impulse responses.
BTFC_FN vec4 car_eval(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(BtfcQuery) query) {
  return field_eval(words, p, query);
}

BTFC_END
#endif
