# lcm-gen's decoders make room for an array before they look whether the message can hold so much: a
# flipped bit in a length would ask for gigabytes. An element takes a byte at least.
s/^( *)(this->[a-zA-Z_0-9]+\.resize\((this->[a-z_0-9]+)\);)/\1if (\3 < 0 || \3 > maxlen - pos) return -1;\n\1\2/
# A string has its final zero at least: a length below 1 would be taken for two gigabytes.
s/if\((__[a-zA-Z_0-9]+_len__) > maxlen - pos\) return -1;/if (\1 < 1 || \1 > maxlen - pos) return -1;/
