// Model car3d: one causal autoregressive field of all channels (survey section 5.3.3; spec/models/car.md).
#ifndef BTFC_CAR3D_H
#define BTFC_CAR3D_H
#include "../btfc_field.h"

BTFC_BEGIN

// Slot 0: tables, records and numbers; slot 1: responses of outputs to noises.
BTFC_FN vec4 car3d_eval(BTFC_WORDS words, BTFC_IN(FieldParams) p, BTFC_IN(BtfcQuery) query) {
  return field_eval(words, p, query);
}

BTFC_END
#endif
