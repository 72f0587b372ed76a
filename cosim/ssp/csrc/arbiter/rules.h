/* The arbiter's rules; rules.c is generated from its definition. */
#ifndef RULES_H
#define RULES_H

#include "variables.h" /* names the function */

int rules_evaluate(const double inputs[N_RULE_INPUTS], double outputs[N_CRITERIA]);

#endif
