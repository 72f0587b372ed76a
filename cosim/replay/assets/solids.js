// solids
