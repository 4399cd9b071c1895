// Lists the engine members that the package's assemblies refer to, from their metadata.
using System;
using System.Collections.Generic;
using System.IO;
using System.Reflection;

public static class Members
{
    public static int Print(string[] arguments)
    {
        var found = new SortedSet<string>(StringComparer.Ordinal);
        for (int i = 1; i < arguments.Length; i++) Collect(Assembly.LoadFrom(arguments[i]), found);
        foreach (string name in found) Console.WriteLine(name);
        return 0;
    }

    static void Collect(Assembly assembly, ISet<string> found)
    {
        Module module = assembly.GetModules()[0];
        foreach (int table in new[] { 0x01000000, 0x0A000000 }) // type references, member references
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
                found.Add(member is Type ? NameOf(type) : NameOf(type) + "." + member.Name.Replace("get_", "").Replace("set_", "").Replace("add_", ""));
            }
        }
    }

    static string NameOf(Type type)
    {
        string name = (type.IsGenericType ? type.GetGenericTypeDefinition() : type).FullName;
        int tick = name.IndexOf('`');
        return (tick < 0 ? name : name.Substring(0, tick)).Replace('+', '.');
    }
}
