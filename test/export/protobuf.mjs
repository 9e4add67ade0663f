// Protobuf messages by the schemas that came with them.

/** `schema` is a FileDescriptorSet. */
export function typeOf(protobuf, name, schema) {
  const root = protobuf.Root.fromDescriptor(protobuf.descriptor.FileDescriptorSet.decode(schema));
  root.resolveAll();
  return root.lookupType(name);
}

const PLAIN = { longs: Number, enums: String, bytes: String, defaults: true };
export const plain = (type, bytes) => type.toObject(type.decode(bytes), PLAIN);
