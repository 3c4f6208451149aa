// Numbers of the models (spec/registry.md).
#ifndef BTFC_MODEL_IDS_H
#define BTFC_MODEL_IDS_H
#include "btfc_language.h"

BTFC_BEGIN

const uint BTFC_MODEL_PATCH = 1u;
const uint BTFC_MODEL_GM = 2u;
const uint BTFC_MODEL_CAR = 3u;
const uint BTFC_MODEL_PTM = 4u;
const uint BTFC_MODEL_PLM = 5u;
const uint BTFC_MODEL_PCARF = 6u;
const uint BTFC_MODEL_PCA = 7u;
const uint BTFC_MODEL_LPCA = 8u;
const uint BTFC_MODEL_GMRF = 9u;
const uint BTFC_MODEL_CAR3D = 10u;

BTFC_END
#endif
