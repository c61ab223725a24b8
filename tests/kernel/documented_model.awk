# Prints the program `name` of docs/writing-a-model.md.
/^<!-- program: / { wanted = ($3 == name) }
/^```/ {
  if (inside) exit
  inside = wanted
  next
}
inside { print }
