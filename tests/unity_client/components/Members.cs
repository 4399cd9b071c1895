// Lists the engine members that the package's assemblies refer to, with their signatures, from the metadata.
using System;
using System.Collections.Generic;
using System.Reflection;

public static class Members
{
    static readonly Dictionary<string, string> Keywords = new Dictionary<string, string>
    {
        { "Single", "float" }, { "Double", "double" }, { "Int32", "int" }, { "UInt32", "uint" }, { "Boolean", "bool" }, { "String", "string" },
        { "Void", "void" }, { "Byte", "byte" }, { "Int64", "long" }, { "UInt64", "ulong" },
    };

    static void Print(string path)
    {
        var found = new SortedSet<string>(StringComparer.Ordinal);
        Collect(Assembly.LoadFrom(path), found);
        foreach (string name in found) Components.Say(name);
    }

    static void Collect(Assembly assembly, ISet<string> found)
    {
        Module module = assembly.GetModules()[0];
        foreach (int table in new[] { 0x01000000, 0x0A000000, 0x2B000000 }) // references to types and members, generic methods
        {
            for (int row = 1; ; row++)
            {
                MemberInfo member;
                try
                {
                    member = module.ResolveMember(table | row);
                }
                catch (ArgumentException)
                {
                    break;
                }
                Type type = member as Type ?? member.DeclaringType;
                if (!type.Assembly.GetName().Name.StartsWith("Unity", StringComparison.Ordinal)) continue;
                if (type.IsGenericType) type = type.GetGenericTypeDefinition();
                found.Add(member is Type ? NameOf(type) + "\t" + Kind(type) : Signed(type, (MemberInfo)Open(type, member)));
            }
        }
    }

    // The member as its type declares it, without the caller's generic arguments.
    static MemberInfo Open(Type type, MemberInfo member)
    {
        foreach (MemberInfo each in type.GetMembers((BindingFlags)62))
        {
            if (each.MetadataToken == member.MetadataToken) return each;
        }
        throw new MissingMemberException(NameOf(type), member.Name);
    }

    static string Signed(Type type, MemberInfo member)
    {
        var field = member as FieldInfo;
        if (field != null) return Line(type, field.Name, field.IsStatic, Short(field.FieldType));
        var method = (MethodBase)member;
        string name = method.Name;
        ParameterInfo[] parameters = method.GetParameters();
        if (method.IsSpecialName && name.StartsWith("get_")) return Line(type, name.Substring(4), method.IsStatic, Short(((MethodInfo)method).ReturnType) + " get");
        if (method.IsSpecialName && name.StartsWith("set_")) return Line(type, name.Substring(4), method.IsStatic, Short(parameters[0].ParameterType) + " set");
        if (method.IsSpecialName && (name.StartsWith("add_") || name.StartsWith("remove_")))
            return Line(type, name.Substring(name.IndexOf('_') + 1), method.IsStatic, "event " + Short(parameters[0].ParameterType));
        string[] types = Array.ConvertAll(parameters, Written);
        string of = method is ConstructorInfo ? "" : Short(((MethodInfo)method).ReturnType);
        return Line(type, method is ConstructorInfo ? "new" : name, method.IsStatic, of + "(" + string.Join(", ", types) + ")");
    }

    static string Line(Type type, string name, bool isStatic, string signature)
    {
        return NameOf(type) + "." + name + "\t" + (isStatic ? "static " : "") + signature;
    }

    static string Written(ParameterInfo parameter)
    {
        string by = parameter.IsOut ? "out " : parameter.ParameterType.IsByRef ? "ref " : "";
        if (Attribute.IsDefined(parameter, typeof(ParamArrayAttribute))) by = "params ";
        return by + Short(parameter.ParameterType.IsByRef ? parameter.ParameterType.GetElementType() : parameter.ParameterType);
    }

    static string Kind(Type type)
    {
        if (typeof(Delegate).IsAssignableFrom(type)) return "delegate";
        return type.IsEnum ? "enum" : type.IsValueType ? "struct" : type.IsInterface ? "interface" : "class";
    }

    static string Short(Type type)
    {
        if (type.IsArray) return Short(type.GetElementType()) + "[]";
        if (type == typeof(object)) return "object";
        string name = type.Name;
        if (!type.IsGenericType) return Keywords.ContainsKey(name) ? Keywords[name] : name;
        return name.Substring(0, name.IndexOf('`')) + "<" + string.Join(", ", Array.ConvertAll(type.GetGenericArguments(), Short)) + ">";
    }

    static string NameOf(Type type)
    {
        string name = type.FullName;
        int tick = name.IndexOf('`');
        return (tick < 0 ? name : name.Substring(0, tick)).Replace('+', '.');
    }
}
